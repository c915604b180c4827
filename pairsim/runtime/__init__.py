"""Services without physics: errors, signals, locks, child processes, MPI and array types."""

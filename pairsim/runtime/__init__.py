"""Knows no physics: errors, signals, locks, child processes, MPI and array types."""

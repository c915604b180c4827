"""One case from validated input to results."""

"""Long rows of equal particles, from solutions of short ones."""

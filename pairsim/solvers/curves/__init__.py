"""Solutions over a distance or a parameter: branches, curves, zeros."""

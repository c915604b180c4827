"""Compute one case, from validated input to a folder of results."""

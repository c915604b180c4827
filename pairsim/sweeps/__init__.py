"""Compute many cases, each in its own process."""

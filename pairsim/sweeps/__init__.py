"""Compute many cases in child processes."""

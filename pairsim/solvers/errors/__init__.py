"""Estimates of the errors of quasi-steady solutions and of runs."""

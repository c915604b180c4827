"""Computation of many cases, each in a child process."""

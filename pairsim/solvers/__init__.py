"""Solvers for time-dependent and quasi-steady problems, independent of input files and output folders."""

"""Disturbances of an axisymmetric solution to first order: the mode cos theta, in the same half-plane."""

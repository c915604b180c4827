"""Fields and residuals one degree higher, from which discretisation errors are estimated."""

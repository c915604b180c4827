"""Fields and residuals one degree higher: the estimates of discretisation errors are made of them."""

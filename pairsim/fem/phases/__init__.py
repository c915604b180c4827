"""A liquid or a solid on its mesh: compiled forms, residual and Jacobian."""

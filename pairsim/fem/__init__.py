"""Finite elements: meshes, residual, Jacobian and constraints of a scene. Only compiled forms are written to files."""

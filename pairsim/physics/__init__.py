"""Formulas in UFL and numpy; no meshes."""

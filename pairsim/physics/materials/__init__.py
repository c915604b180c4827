"""Constitutive laws: pure UFL, without state, each stress as its (z, r) block and its hoop component."""

"""Constitutive laws as UFL expressions without state; a stress is a (z, r) block and a hoop component."""

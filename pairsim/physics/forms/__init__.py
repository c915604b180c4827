"""Weak forms; each function returns one term."""

"""Weak forms, one term a function."""

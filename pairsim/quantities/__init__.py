"""Quantities: the scales of a problem, kinds of quantities, and numbers with their errors as text."""

"""Subjects of the validation book, docs/validation: each computes its comparisons, which the pages show."""

"""Common parts of all questions: their record, the session that computes them, quasi-steady solutions, warnings."""

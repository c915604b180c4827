"""Evaluation of tables: master curves, time series, travels, and what uncertain inputs contribute."""

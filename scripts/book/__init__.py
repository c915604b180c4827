"""Shared code of the scripts that compute studies and write their pages: cases, results, statements, pages."""

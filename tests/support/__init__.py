"""Shared by the tests: scenes solved in process, commands run as a user runs them, samples of files."""

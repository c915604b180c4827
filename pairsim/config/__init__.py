"""Turns YAML or a dict into a validated case."""

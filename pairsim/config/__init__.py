"""YAML or a dict to a checked case."""

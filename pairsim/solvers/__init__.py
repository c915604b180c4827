"""Arrays in, steps or points out; no YAML, no folders."""

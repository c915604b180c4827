"""Parses commands and calls the layer below."""

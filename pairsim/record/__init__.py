"""Folders of results: tables, fields, run.json, checkpoints; nothing is solved."""

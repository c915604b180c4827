"""Folders of results: tables, fields, run.json and checkpoints; nothing is solved here."""

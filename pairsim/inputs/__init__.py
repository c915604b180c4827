"""Input files of all commands: reading, checking, and the list of their keys."""

"""A scene whose distances are held: its solution, and how it is continued to other parameters."""

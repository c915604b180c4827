"""The time scheme: step sizes, and the history of the last steps."""

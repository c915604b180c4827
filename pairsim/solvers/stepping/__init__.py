"""The time scheme: step sizes, and what the last steps have left."""

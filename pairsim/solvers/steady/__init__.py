"""Scenes whose distances are held: their solutions, and the continuation to other parameters."""

"""Trains: rows of equal particles in a periodic cell, and what becomes of disturbances of their distances."""

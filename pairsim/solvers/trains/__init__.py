"""Trains: rows of equal particles in a periodic cell, and the growth or decay of disturbances of their distances."""

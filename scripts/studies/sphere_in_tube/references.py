"""Classical value for a/R = 1/2; the tables of Haberman and Sayre (1958) are up to 0.4 % off."""

K = 5.9474
"""Drag over 6 pi eta_0 a U in a Newtonian liquid."""

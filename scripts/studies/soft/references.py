"""Own theory of first order in Ca_e: collocation with the exact flow around rigid spheres, checked by reciprocity."""

S = {(0.4, 0.1): 5.475377e-2, (0.4, 0.3): 1.965724e-2, (0.2, 0.1): -9.88438e-4}
"""dU/Ca_e of a pair as Ca_e vanishes, by diameter and distance [U_av]."""
F_3, F_5 = 1.4454685, -0.0059043
"""Modes of the outline of a single sphere of diameter 0.4, r = a (1 + Ca_e sum f_n P_n)."""

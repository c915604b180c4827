"""Own multipoles with exact Fourier-Bessel images of the wall."""

U = {0.2: 1.94677814, 0.4: 1.79081169, 0.6: 1.55302692}
"""Velocity of a free sphere by its diameter [U_av]."""
DP_PLUS = {0.2: 0.0102456698, 0.4: 0.3327323298, 0.6: 2.7447509031}
"""Extra pressure drop of a free sphere [eta_0 U_av/D_c]."""
DRAGGED = {0.2: 1.67947888, 0.4: 3.59137327, 0.6: 11.0918968}
"""Drag over 6 pi eta_0 a times the velocity of a sphere that is dragged through liquid at rest."""
HELD = {0.2: 1.63478639, 0.4: 3.21573662, 0.6: 8.61300714}
"""The same of a sphere that is held, times the largest velocity of the flow."""
PAIR_U = {0.1: 1.781813862, 0.3: 1.788255961}
"""Velocity of a pair of diameter 0.4 by its distance [U_av]."""
PAIR_DP_PLUS = {0.1: 0.6196818815, 0.3: 0.6533886603}
"""Extra pressure drop of such a pair [eta_0 U_av/D_c]."""

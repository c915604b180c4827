"""The tube in the units of pairsim: lengths in its diameter D_c, velocities in the mean velocity U_av."""

from __future__ import annotations

from math import pi

TUBE_RADIUS = 0.5  # [D_c]
FLOW_RATE = pi / 4  # [U_av D_c^2]

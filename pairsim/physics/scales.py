"""The tube in the units of pairsim: lengths in tube diameters, velocities in the mean velocity."""

from __future__ import annotations

from math import pi

TUBE_RADIUS = 0.5

FLOW_RATE = pi / 4

"""Rigid spheres at the centre of a square duct: data of ILFHC by B. Harding.

They are of github.com/brendanharding/ILFHC (MIT licence), by the diameter over the width H of the duct.
"""

U = {0.05: 0.998588, 0.1: 0.994354, 0.15: 0.987307, 0.2: 0.977445}
"""Velocity over the largest one of the flow."""
DRAG = {0.05: 1.0871, 0.1: 1.1936, 0.15: 1.3204, 0.2: 1.4720}
"""Lateral drag over 6 pi eta a."""
INERTIA = {0.05: 0.944, 0.1: 0.774, 0.15: 0.626, 0.2: 0.498}
"""Rate by inertia over U_max/H Re_max (diameter/width)^3/4."""

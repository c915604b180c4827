"""Own code of another method, and the table HE-2D-FEM-22 of dclab, interpolated linearly.

The table is by Wittwer and Aland (doi 10.6084/m9.figshare.20630940), finite elements by COMSOL.
"""

DRAG = {1.0: 5.9474, 0.8: 4.3702}
"""F over 3 pi K V^n D_p^(2 - n) at half the diameter of the tube, by n."""
DEFORMATION = {
    (0.35, 0.07): 0.001157,
    (0.35, 0.1): 0.002375,
    (0.35, 0.14): 0.004718,
    (0.5, 0.07): 0.002649,
    (0.5, 0.1): 0.00547,
    (0.5, 0.14): 0.010978,
    (0.6, 0.07): 0.004439,
    (0.6, 0.1): 0.009162,
    (0.6, 0.14): 0.018385,
    (0.7, 0.07): 0.007699,
    (0.7, 0.1): 0.015638,
    (0.7, 0.14): 0.030492,
}
"""Deformation 1 - 2 sqrt(pi area)/perimeter by beta and Ca_e."""

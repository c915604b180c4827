"""A force-free sphere alone on the axis of a tube, in a Newtonian liquid without inertia."""

from __future__ import annotations


def velocity(beta: float) -> float:
    """Velocity of a sphere whose diameter is beta times that of the tube, over the mean velocity of the liquid.

    It is the approximation of W. L. Haberman and R. M. Sayre (1958); pairs of slightly soft spheres, 2 tube diameters
    apart, are up to 0.6 % slower at beta = 0.3 to 0.45.
    """
    return 2 * (1 - 2 / 3 * beta**2 - 0.20217 * beta**5) / (1 - 0.75857 * beta**5)


def velocity_by_size(beta: float) -> float:
    """The derivative of log(`velocity`) with respect to log(beta)."""
    above = (4 / 3 * beta**2 + 5 * 0.20217 * beta**5) / (1 - 2 / 3 * beta**2 - 0.20217 * beta**5)
    return 5 * 0.75857 * beta**5 / (1 - 0.75857 * beta**5) - above

"""A force-free sphere alone on the axis of a tube, in a Newtonian liquid without inertia."""

from __future__ import annotations


def velocity(beta: float) -> float:
    """Velocity of a sphere whose diameter is beta times that of the tube, over the mean velocity of the liquid.

    It is the approximation of W. L. Haberman and R. M. Sayre (1958), which is good to about 1 % up to beta = 0.6.
    """
    return 2 * (1 - 2 / 3 * beta**2 - 0.20217 * beta**5) / (1 - 0.75857 * beta**5)


def velocity_by_size(beta: float) -> float:
    """The derivative of the logarithm of `velocity` by that of beta."""
    above = (4 / 3 * beta**2 + 5 * 0.20217 * beta**5) / (1 - 2 / 3 * beta**2 - 0.20217 * beta**5)
    return 5 * 0.75857 * beta**5 / (1 - 0.75857 * beta**5) - above

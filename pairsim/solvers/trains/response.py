"""The response of a train to a change of one of its distances, as a series in the rate of change.

Let a distance of a periodic cell change as exp(lambda t). The unknowns follow as Y exp(lambda t). With the Jacobian J
of the residual, its derivatives M with respect to the rates of the unknowns and m with respect to the rate of the
distance (`pairsim.solvers.steady.motion`), and the tangent Y_0 of solutions at held distances,

    Y = Y_0 + lambda Y_1 + ...,    Y_1 = -J^-1 (M Y_0 + m),    Y_(k+1) = -J^-1 M Y_k.

Velocities U and positions c of the particles are linear in Y. As all particles are equal, both have Fourier components
U(k) and c(k) of waves exp(i k j) over the particles j, and each wave grows at the rate lambda(k) for which the
velocities are the rates of the positions,

    lambda c(k; lambda) = U(k; lambda).

To first order this is lambda = A/(C' - E), with the slopes A of the velocities at held distances, their derivatives E
with respect to rates, and the derivatives C' of positions: the slow manifold of `pairsim.solvers.curves.slow_manifold`.
The series converges where |lambda| is less than the slowest rate at which shapes and stresses relax.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.polynomial import Polynomial

from pairsim.runtime.arrays import Array
from pairsim.solvers.steady.motion import material_rates, moving_residual
from pairsim.solvers.steady.scene import SteadySolver

ORDERS = 4  # number of terms of the series beyond Y_0; chosen
PROBE = 1e-4  # step of differences of the residual with respect to rates, as a fraction of those of unit growth; chosen


def response(train: SteadySolver) -> tuple[Array, Array]:
    """Derivatives of velocities and positions with respect to the first distance of a cell of n particles.

    Args:
        train: The cell, at a solution.

    Returns:
        Coefficients of the powers 0 to `ORDERS` of the rate lambda: those of the velocities [U_av/D_c], and those of
        the centres of volume, both of shape (ORDERS + 1, n).

    Raises:
        NoSteadyState: Newton's matrix is singular at the solution.
    """
    at = train.linearise()
    here, y, (h, _) = at.parameters, at.y, train.state()
    rates = np.eye(len(here.gaps))[0]
    change = at.residual_change(partial(here.with_longer_gap, 0))
    U, places = list[Array](), list[Array]()
    for _ in range(ORDERS + 1):
        Y = -at.solve(change)
        h_t = material_rates(train, here, Y, rates)
        U.append(Y[train.constraints.fields["U_p"]])
        places.append(np.array([body.mean(h_t, h) for body in train.bodies]))
        ends = [moving_residual(train, here, y, s * Y, s * rates) for s in (PROBE, -PROBE)]
        change, rates = (ends[0] - ends[1]) / (2 * PROBE), 0 * rates
    # A displacement of all particles together changes no velocity in a uniform tube. What the sum contains is the
    # effect of moving each particle relative to the cells of the mesh, and is subtracted.
    by_cells = np.sum(U, axis=1) / places[0].sum()
    return np.array(U) - np.outer(by_cells, places[0]), np.array(places)


def growth_rates(U: Array, places: Array, orders: int) -> Array:
    """Growth rates lambda(2 pi m/n), m = 0, ..., n - 1, from a truncated series [U_av/D_c], complex, (n,).

    A growth rate is a root of a polynomial of degree `orders`: the one nearest to the root to first order.

    Args:
        U, places: The response of a cell, from `response`.
        orders: Largest power of the rate that is kept, at least 1.
    """
    terms, moved = (np.fft.fft(part[: orders + 1], axis=1)[:, 1:] for part in (U, places))
    terms[1:] -= moved[:-1]
    first = -terms[0] / terms[1]
    roots = [Polynomial(each).roots() for each in terms.T]
    return np.array([0.0, *(of[abs(of - near).argmin()] for of, near in zip(roots, first, strict=True))])

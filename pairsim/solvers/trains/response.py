"""What a particle of a train does to all others when its distance changes, as a series in the rate of change.

Let a distance of a periodic cell change as exp(lambda t). The unknowns follow as Y exp(lambda t), where with the
Jacobian J of the residual, its derivatives M by the rates of the unknowns and m by that of the distance
(`pairsim.solvers.steady.motion`), and the tangent Y_0 of held distances

    Y = Y_0 + lambda Y_1 + ...,    Y_1 = -J^-1 (M Y_0 + m),    Y_(k+1) = -J^-1 M Y_k.

Velocities U and positions c of the particles are linear in Y. In a cell whose particles are equal both have the Fourier
components U(k) and c(k) of waves exp(i k j) over the particles j, and each wave grows at the rate lambda(k) for which
the positions change with the velocities,

    lambda c(k; lambda) = U(k; lambda).

Up to first order this is lambda = A/(C' - E) with the slopes A at held distances, E by which rates change velocities
and the derivatives C' of positions, the slow manifold of `pairsim.solvers.curves.slow_manifold`. The series converges
where |lambda| is less than the slowest rate at which shapes and stresses relax.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.polynomial import Polynomial

from pairsim.runtime.arrays import Array
from pairsim.solvers.steady.motion import material_rates, moving_residual
from pairsim.solvers.steady.scene import SteadySolver

ORDERS = 4  # of the series; chosen
PROBE = 1e-4  # rates at which the residual is differenced, relative to the rate of the distance; chosen


def response(train: SteadySolver) -> tuple[Array, Array]:
    """Derivatives of velocities and positions by the first distance of a cell of several particles, at a solution.

    Returns:
        By powers of the rate, those of the velocities [U_av/D_c], and those of the centres of volume, both of shape
        (ORDERS + 1, n).

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
    # Moving all particles changes no velocity, but for what moving it within its cells does to each of them.
    by_cells = np.sum(U, axis=1) / places[0].sum()
    return np.array(U) - np.outer(by_cells, places[0]), np.array(places)


def growth_rates(U: Array, places: Array, orders: int) -> Array:
    """Growth rates lambda(2 pi m/n), m = 0, ..., n - 1, by a number of terms of the series, complex, (n,).

    Args:
        U, places: The response of a cell.
        orders: The number of terms, at least 1; of the roots of the polynomial with so many, a growth rate is the one
            nearest to that of the first term alone.
    """
    terms, moved = (np.fft.fft(part[: orders + 1], axis=1)[:, 1:] for part in (U, places))
    terms[1:] -= moved[:-1]
    first = -terms[0] / terms[1]
    roots = [Polynomial(each).roots() for each in terms.T]
    return np.array([0.0, *(of[abs(of - near).argmin()] for of, near in zip(roots, first, strict=True))])

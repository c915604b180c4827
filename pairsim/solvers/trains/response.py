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

from dataclasses import dataclass
from functools import partial

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.steady.motion import material_rates, moving_residual
from pairsim.solvers.steady.scene import SteadySolver
from pairsim.solvers.steady.tangents import residual_change

ORDERS = 4  # of the series; chosen
PROBE = 1e-4  # rates at which the residual is differenced, relative to the rate of the distance; chosen
ITERATIONS = 50  # of Newton's method for a root of a polynomial
CLOSE = 1e-12  # its last step, relative to the root; chosen


@dataclass(frozen=True)
class Response:
    """Velocities and positions of the particles of a cell, by powers of the rate.

    Attributes:
        U: Derivatives of the velocities by the distance, (ORDERS + 1, n) [U_av/D_c].
        places: Derivatives of the positions of the centres of volume, (ORDERS + 1, n).
    """

    U: Array
    places: Array

    @staticmethod
    def of(train: SteadySolver) -> Response:
        """The response to a change of the first distance of a cell of several particles, at a solution.

        Raises:
            NoSteadyState: Newton's matrix is singular at the solution.
        """
        train.factor()
        here, y, fields = train.parameters, train.y, train.constraints.fields["U_p"]
        h, _ = train.state()
        first, none = np.eye(len(here.gaps))[0], np.zeros(len(here.gaps))

        def moved(y_t: Array, rates: Array) -> Array:
            h_t = material_rates(train, here, y_t, rates)
            return np.array([body.mean(h_t, h) for body in train.bodies])

        def dropped(y_t: Array, rates: Array) -> Array:
            """Derivative of the residual by rates."""
            ends = [moving_residual(train, here, y, s * y_t, s * rates) for s in (PROBE, -PROBE)]
            return (ends[0] - ends[1]) / (2 * PROBE)

        change, rates = residual_change(train, partial(here.with_longer_gap, 0)), first
        U, places = list[Array](), list[Array]()
        for _ in range(ORDERS + 1):
            Y = -train.newton.linear_solve(change)
            U.append(Y[fields])
            places.append(moved(Y, rates))
            change, rates = dropped(Y, rates), none
        # Moving all particles changes no velocity, but for what moving it within its cells does to each of them.
        by_cells = np.sum(U, axis=1) / places[0].sum()
        return Response(np.array(U) - np.outer(by_cells, places[0]), np.array(places))

    def rates(self, orders: int = ORDERS) -> Array:
        """Growth rates lambda(2 pi m/n), m = 1, ..., n - 1, by a number of terms of the series, complex, (n - 1,)."""
        U, places = (np.fft.fft(part[: orders + 1], axis=1)[:, 1:] for part in (self.U, self.places))
        if orders == 0:
            return np.asarray(U[0] / places[0])
        terms = U.copy()
        terms[1:] -= places[:-1]
        return np.array([_small_root(each) for each in terms.T])


def _small_root(terms: Array) -> complex:
    """The root of a polynomial, coefficients ascending, that goes on from that of its first two terms.

    Raises:
        NoSteadyState: It was not found.
    """
    polynomial = np.polynomial.Polynomial(terms)
    slope, root = polynomial.deriv(), -terms[0] / terms[1]
    for _ in range(ITERATIONS):
        step = polynomial(root) / slope(root)
        root -= step
        if abs(step) <= CLOSE * abs(root):
            return complex(root)
    raise NoSteadyState("a growth rate was not found: disturbances change faster than shapes and stresses follow")

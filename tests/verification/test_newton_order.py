"""With the exact matrix in every iteration Newton's method converges quadratically, in time and quasi-steady."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support.scenes import soft_pair

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.liquids import NEWTONIAN, Liquid, single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.power_law import PowerLaw
from pairsim.physics.solids import soft
from pairsim.runtime.arrays import Array
from pairsim.solvers.nonlinear.convergence import Report
from pairsim.solvers.nonlinear.jacobian_lagging import MatrixPolicy
from pairsim.solvers.nonlinear.newton import Newton, NewtonOptions
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.predictors import place_undeformed
from pairsim.solvers.steady.scene import SteadySolver
from pairsim.solvers.transient.transient import Transient

EXACT = NewtonOptions(tolerance=1e-13, matrix=MatrixPolicy(slow=0.0, other_step=-1.0, far=0.0))
"""Never takes over a matrix, and goes on to rounding."""
LIQUIDS = {"newtonian": NEWTONIAN, "giesekus": single(Giesekus(), De=1.0), "power-law": single(PowerLaw(n=0.7))}


def residuals(newton: Newton, solve: Callable[[], Report]) -> list[float]:
    """Norms of the residual before and after each iteration of a solve."""
    norms: list[float] = []
    newton._snes.setMonitor(lambda snes, iteration, norm: norms.append(norm))
    report = solve()
    newton._snes.cancelMonitor()
    assert report.converged, report
    assert report.factorisations == report.iterations == len(norms) - 1
    return norms


def observed_orders(newton: Newton, solution: Array, away: Array, solve: Callable[[Array], Report]) -> list[float]:
    """Orders by which the residual falls in each iteration that rounding does not show in.

    One sequence of norms tells the order badly, as the part of the error that the next iteration leaves differs from
    one to the next. So the solve begins twice, the second time at half the distance from the solution: where the norms
    of an iteration have the ratio q, those of the next one have q^2.
    """
    far, near = (residuals(newton, lambda guess=solution + part * away: solve(guess)) for part in (0.5, 0.25))
    known = [(a, b) for a, b in zip(far, near, strict=False) if min(a, b) > 100 * min(*far, *near)]
    ratios = [np.log(a / b) for a, b in known]
    return [float(b / a) for a, b in pairwise(ratios)]


@pytest.mark.parametrize(
    "name", ["newtonian", *(pytest.param(name, marks=pytest.mark.slow) for name in ("power-law", "giesekus"))]
)
def test_newton_converges_quadratically_in_time(name: str) -> None:
    """From the velocities and stresses before a step."""
    liquid = LIQUIDS[name]
    pair = soft_pair(0.4, 0.1, 0.1, mesh=MeshSettings(Np=8), length=4.0, periodic=False, liquid=liquid, t_end=1.0)
    transient = Transient(replace(pair, newton=EXACT))
    try:
        *_, last = transient.steps(iter([0.01]))
        before, U_m = transient.history.y[0], float(last.observation.U.mean())
        solution, _ = transient._solved(before.copy(), 0.04, U_m)
        orders = observed_orders(
            transient.newton, solution, before - solution, lambda guess: transient._solved(guess, 0.04, U_m)[1]
        )
    finally:
        transient.close()
    assert len(orders) >= 2, orders
    assert min(orders) > 1.8, orders


@pytest.mark.parametrize("liquid", LIQUIDS.values(), ids=LIQUIDS.keys())
def test_newton_converges_quadratically_on_a_curve(liquid: Liquid) -> None:
    """From a place with stiffer particles and, in a viscoelastic liquid, of a smaller De."""
    problem = SteadyProblem(betas=(0.4, 0.4), length=4.0, periodic=False, mesh=MeshSettings(Np=8), newton=EXACT)
    places = ((0.05, 0.3), (0.08, 0.6))
    start, end = (Parameters((0.1,), soft(Ca_e, Ca_e), liquid.with_De(De)) for Ca_e, De in places)
    steady = SteadySolver(problem, start)
    place_undeformed(steady)
    try:
        assert steady.solve(start).converged
        before = steady.y
        assert steady.solve(end).converged
        solution = steady.y
        orders = observed_orders(steady.newton, solution, before - solution, lambda guess: steady.solve(end, guess))
    finally:
        steady.close()
    assert len(orders) >= 2, orders
    # The viscosity of a power law bends sharply where the liquid is nearly at rest.
    assert min(orders) > (1.7 if liquid == LIQUIDS["power-law"] else 1.8), orders

"""A soft sphere in unbounded uniaxial extension: exact at finite deformation, so it tests the coupled dynamics.

The forms, ties and time scheme are those of every run; only the velocity on the outer boundary, 20 radii away, is
prescribed instead of a tube flow. The sphere becomes a spheroid of axial stretch l. With the stresslet of a spheroid
whose surface moves linearly, l follows from dl/dt = l (K Ca - l^2 + 1/l)/(K - 3), K = 7.5 X l^3, time in eta/G.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import march
from mpi4py import MPI
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

from pairsim.continuation import find_fold
from pairsim.geometry import MeshSettings
from pairsim.parameters import Parameters
from pairsim.quadratic import Array
from pairsim.steady import Steady
from pairsim.stepsize import StepControl
from pairsim.transient import Problem, Step

START_UP = {0.5: 1.0727, 1: 1.1272, 2: 1.1980, 3: 1.2371, 5: 1.2707, 10: 1.2848}
RELAXATION = {0.5: 1.21294, 1: 1.15119, 2: 1.07652, 3: 1.03894, 4: 1.01990}


def stretches(Ca: float, times: list[float], *, rate: float = 1.0, l_0: float = 1.0, Np: int = 20) -> list[float]:
    """Axial stretch at the times t G/eta."""
    beta = 0.05  # the wall of the tube is 20 radii away, so are the ends
    problem = Problem(
        (beta,),
        (Ca,),
        (),
        1.0,
        False,
        MeshSettings(Np=Np),
        StepControl(3e-4 * beta / 2, 1e-9, 5.0),  # velocities are of the order of radius times rate
        0.01 * Ca,
        boundary_velocity=lambda x: rate * x * [1.0, -0.5],
        U_m=0.0,
        start=lambda x: x * [l_0, l_0**-0.5],
    )
    landed = {round(t * Ca, 12) for t in times}

    def stretch(step: Step) -> float:
        D = step.observation.D[0]
        return ((1 + D) / (1 - D)) ** (2 / 3)

    steps = march(problem, [t * Ca for t in times])
    return [stretch(s) for s in steps if round(s.t, 12) in landed]


def K(stretch: float) -> float:
    e = np.sqrt(1 - stretch**-3)
    X = 8 / 15 * e**5 / ((3 - e**2) * np.log((1 + e) / (1 - e)) - 6 * e) if e > 1e-3 else 1.0
    return float(7.5 * X * stretch**3)


def steady_Ca(stretch: float) -> float:
    return (stretch**2 - 1 / stretch) / K(stretch)


def exact(Ca: float, times: list[float]) -> np.ndarray:
    def rate(_: float, x: np.ndarray) -> list[float]:
        return [x[0] * (K(x[0]) * Ca - x[0] ** 2 + 1 / x[0]) / (K(x[0]) - 3)]

    return solve_ivp(rate, (0, max(times)), [1.0], t_eval=times, rtol=1e-9, atol=1e-10).y[0]


def test_start_up_follows_the_exact_solution() -> None:
    assert stretches(0.1, list(START_UP)) == pytest.approx(list(START_UP.values()), rel=1e-3)
    assert exact(0.1, list(START_UP)) == pytest.approx(list(START_UP.values()), rel=1e-4)


def test_relaxation_without_flow_follows_the_exact_solution() -> None:
    found = stretches(0.1, list(RELAXATION), rate=0.0, l_0=1.3)
    assert found == pytest.approx(list(RELAXATION.values()), rel=1e-3)


def test_below_the_fold_it_settles_and_past_it_it_goes_on() -> None:
    """Past l = 2.25 the poles are compressed below 2/3, where a neo-Hookean surface wrinkles: l stays below."""
    times = [2.0, 4.0, 5.0, 6.0]
    past, below = stretches(0.36, times), stretches(0.3, [*times, 10.0])
    assert past == pytest.approx(exact(0.36, times), rel=5e-3)
    assert below == pytest.approx(exact(0.3, [*times, 10.0]), rel=5e-3)
    end = brentq(lambda x: steady_Ca(x) - 0.3, 1.5, 4.0)
    assert below[-1] < end
    assert past[3] > end


class Relation:
    """The exact steady relation of stretch and Ca_e in the place of the discrete equations; y is the stretch less 1."""

    Ca_e = slope = 0.0

    def residual_at(self, y: Array) -> Array:
        return K(1 + y[0]) * (self.Ca_e - steady_Ca(1 + y[0])) * np.ones(1)

    def factor_at(self, y: Array) -> bool:
        self.slope = float((self.residual_at(y + 1e-5) - self.residual_at(y - 1e-5))[0] / 2e-5)
        return True

    def linear_solve(self, r: Array) -> Array:
        return r / self.slope

    def scaled(self, step: Array, y: Array) -> dict[str, float]:
        return {"h": float(np.abs(step).max())}

    def state(self, y: Array) -> tuple[Array, Array]:
        return y, y

    def overstretched(self, y: Array) -> bool:
        return False

    def forget(self) -> None:
        pass


class Spheroid(Steady):
    """A scene of that one unknown, without mesh and cells: what is left is the continuation."""

    newton: Any
    snapshot: Any = property(lambda self: (self.parameters, self.y))

    def __init__(self, stretch: float) -> None:
        self.comm, self.newton = MPI.COMM_SELF, Relation()
        self.parameters, self.y = Parameters((), (steady_Ca(stretch),)), np.array([stretch - 1])
        self.problem: Any = SimpleNamespace(betas=(1.0,), newton_tolerance=1e-9)
        self.tie: Any = SimpleNamespace(fields={"h": np.array([0])}, size=1)
        self.iterations = self.factorisations = 0
        self._factored = None

    def recall(self, snapshot: Any) -> None:
        self.parameters, self.y = snapshot

    def folded(self, parameters: Parameters, y: Array) -> bool:
        return False

    def distorted(self, parameters: Parameters | None = None, y: Array | None = None) -> bool:
        return False

    def apply(self, parameters: Parameters) -> Array:
        (self.newton.Ca_e,) = parameters.Ca_es
        return np.empty(0)

    def distortion_of(self, h: Array, x: Array) -> float:
        return 1.0


def test_continuation_finds_the_fold_of_the_exact_relation() -> None:
    fold = find_fold(Spheroid(1.2), Parameters((), (1.0,)))
    most = -minimize_scalar(lambda x: -steady_Ca(x), (3.0, 4.0, 5.0)).fun
    assert fold.passed
    assert fold.parameters.Ca_es[0] == pytest.approx(most, rel=5e-4)
    assert most == pytest.approx(0.33339, abs=1e-5)

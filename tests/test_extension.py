"""A soft sphere in unbounded uniaxial extension: exact at finite deformation, so it tests the coupled dynamics.

The forms, ties and time scheme are those of every run; only the velocity on the outer boundary, 20 radii away, is
prescribed instead of a tube flow. The sphere becomes a spheroid of axial stretch l. With the stresslet of a spheroid
whose surface moves linearly, l follows from dl/dt = l (K Ca - l^2 + 1/l)/(K - 3), K = 7.5 X l^3, time in eta/G.
"""

from __future__ import annotations

import numpy as np
import pytest
from conftest import march
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from pairsim.mesh import MeshSettings
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
    end = brentq(lambda x: (x**2 - 1 / x) / K(x) - 0.3, 1.5, 4.0)
    assert below[-1] < end
    assert past[3] > end

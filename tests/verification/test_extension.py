"""A soft sphere in unbounded uniaxial extension against its ordinary differential equation, and its fold."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from studies.extension.references import FOLD, RELAXATION, STEADY
from studies.extension.smooth_sphere import SmoothSphere
from studies.extension.spheroid import exact_stretches, steady_Ca, stretches

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.drive import Drive
from pairsim.physics.solids import Solid, soft
from pairsim.physics.solids.kelvin_voigt import KelvinVoigt
from pairsim.physics.solids.mooney_rivlin import MooneyRivlin
from pairsim.physics.solids.neo_hookean import NeoHookean
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import begin, follow

START_UP = {0.5: 1.0727, 1: 1.1272, 2: 1.1980, 3: 1.2371, 5: 1.2707, 10: 1.2848}
SOLIDS = [KelvinVoigt(0.1, eta=1.5), MooneyRivlin(0.1, c=0.5)]


@pytest.mark.slow
def test_start_up_follows_the_exact_solution() -> None:
    assert stretches(NeoHookean(0.1), list(START_UP), Np=10) == pytest.approx(list(START_UP.values()), rel=1e-3)
    assert exact_stretches(NeoHookean(0.1), list(START_UP)) == pytest.approx(list(START_UP.values()), rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: solid.name)
def test_every_solid_follows_its_exact_solution(solid: Solid) -> None:
    times = [0.5, 2.0, 5.0, 10.0]
    found, wanted = stretches(solid, times, Np=10), exact_stretches(solid, times)
    assert found == pytest.approx(wanted, rel=1e-3)
    assert wanted != pytest.approx(exact_stretches(NeoHookean(solid.Ca_e), times), rel=1e-2), "it is another law"


@pytest.mark.slow
def test_a_viscous_solid_creeps_as_linear_viscoelasticity_says() -> None:
    """Strain 5/2 Ca_e [1 - exp(-2 t/(3 + 2 eta_p))], t in eta_0/G_p; what is left is of second order in Ca_e."""
    eta, times = 2.0, np.array([1.0, 3.0, 10.0])
    found = [(np.array(stretches(KelvinVoigt(Ca_e, eta=eta), list(times), Np=10)) - 1) / Ca_e for Ca_e in (0.01, 0.02)]
    assert 2 * found[0] - found[1] == pytest.approx(2.5 * (1 - np.exp(-2 * times / (3 + 2 * eta))), rel=2e-3)


@pytest.mark.slow
def test_relaxation_without_flow_follows_the_exact_solution() -> None:
    found = stretches(NeoHookean(0.1), list(RELAXATION), rate=0.0, l_0=1.3, Np=10)
    assert found == pytest.approx(list(RELAXATION.values()), rel=1e-3)


@pytest.mark.slow
def test_below_the_fold_it_settles_and_past_it_it_goes_on() -> None:
    """Past l = 2.25 the poles are compressed below 2/3, where a neo-Hookean surface wrinkles: l stays below."""
    times = [2.0, 4.0, 5.0, 6.0]
    past = stretches(NeoHookean(0.36), times, Np=10)
    below = stretches(NeoHookean(0.3), [*times, 10.0], Np=10)
    assert past == pytest.approx(exact_stretches(NeoHookean(0.36), times), rel=5e-3)
    assert below == pytest.approx(exact_stretches(NeoHookean(0.3), [*times, 10.0]), rel=5e-3)
    end = brentq(lambda x: steady_Ca(x) - 0.3, 1.5, 4.0)
    assert below[-1] < end
    assert past[3] > end


@pytest.mark.slow
@pytest.mark.parametrize(
    ("Np", "degree"), [(20, 3), *(pytest.param(40, degree, marks=pytest.mark.long) for degree in (3, 5))]
)
def test_the_decay_of_disturbances_tells_the_fold_of_steady_extension(Np: int, degree: int) -> None:
    """At l = 4.1, where the wall is 12 half-lengths away."""
    drive = Drive(boundary=lambda x: x * [1.0, -0.5])
    problem = SteadyProblem(betas=(0.02,), length=1.0, periodic=False, mesh=MeshSettings(Np=Np), drive=drive)
    sphere = SmoothSphere(problem, Parameters((), soft(0.05)), degree)
    begin(sphere)
    for Ca, D in STEADY.items():
        assert follow(sphere, Parameters((), soft(Ca))) is None
        assert sphere.observe().D[0] == pytest.approx(D, rel=2e-3)
    end = follow(sphere, Parameters((), soft(1.0)))
    assert end is not None
    assert end.proven
    assert end.kind == "fold"
    Ca, error = end.at["Ca_e"]
    assert Ca == pytest.approx(FOLD, rel=5e-3)
    assert abs(Ca - FOLD) < error
    assert -minimize_scalar(lambda x: -steady_Ca(x), (3.0, 4.0, 5.0)).fun == pytest.approx(FOLD, abs=1e-5)
    sphere.close()

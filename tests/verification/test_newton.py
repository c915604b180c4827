"""Newton's matrix is the derivative of the residual (T A P against finite differences), and serves while it does."""

from __future__ import annotations

import itertools
from typing import Any

import pytest
import ufl
from mpi4py import MPI
from support.scenes import soft_pair, tube

import pairsim
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.fem.phases import compiled_phase
from pairsim.physics import solids
from pairsim.physics.liquids import Liquid
from pairsim.physics.liquids.bingham import Bingham
from pairsim.physics.liquids.carreau import Carreau
from pairsim.physics.liquids.fene_p import FeneP
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.power_law import PowerLaw
from pairsim.physics.solids.kelvin_voigt import KelvinVoigt
from pairsim.solvers.check_law import jacobian_off
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.transient import Transient

MODES = Giesekus(time=1.0, weight=0.6), FeneP(L2=50.0, time=0.1, weight=0.4)
TWO_MODES = Liquid(Carreau(n=0.5, Cu=2.0), 0.2, 0.5, MODES)


def problems() -> dict[str, Problem]:
    coarse = {"mesh": MeshSettings(Np=8), "length": 4.0}
    soft = soft_pair(0.4, 0.1, 0.1, **coarse)
    values = soft.__dict__
    return {
        "soft pair, periodic": soft,
        "soft and rigid, periodic": Problem(**{**values, "solids": solids.soft(0.1, 0.0)}),
        "unequal rigid, developed": Problem(
            **{**values, "betas": (0.4, 0.3), "solids": solids.soft(0.0, 0.0), "periodic": False}
        ),
        "three, developed": Problem(
            **{
                **values,
                "betas": (0.4,) * 3,
                "solids": solids.soft(0.1, 0.0, 0.2),
                "gaps": (0.1, 0.2),
                "periodic": False,
            }
        ),
        "viscous solids in a power-law liquid": Problem(
            **{**values, "solids": (KelvinVoigt(0.1, eta=2.0),) * 2, "liquid": Liquid(PowerLaw(n=0.4))}
        ),
        "modes in a Carreau liquid": Problem(**{**values, "liquid": TWO_MODES, "periodic": False}),
    }


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if "modes" in name else ()) for name in problems()]
)
def test_jacobian_matches_differences(name: str) -> None:
    assert jacobian_off(problems()[name]) < 1e-6


@pytest.mark.slow
def test_the_jacobian_of_a_law_that_bends_sharply_is_right() -> None:
    """Differences with a step of 1e-5 alone are off by 3e-5 themselves."""
    control = StepControl(2e-3, 1e-8, 2.0)
    liquid = Liquid(Bingham(Bn=1.0, m=100.0))
    problem = tube(0.5, MeshSettings(max_size=0.1), control, 1e-3, liquid=liquid, t_end=1.0)
    assert jacobian_off(problem) < 1e-6


def test_small_steps_share_a_matrix() -> None:
    """Two or three iterations each; one that has once contracted badly is made anew once, not at every step."""
    control = StepControl(1e-3, 1e-8, 2.0, fixed=7.5e-4)
    pair = soft_pair(0.4, 0.1, 0.1, length=4.9, periodic=False, mesh=MeshSettings(Np=10), control=control)
    transient = Transient(pair)
    steps = transient.steps(iter([0.03]))
    first = [next(steps).report for _ in range(10)]
    assert sum(report.factorisations for report in first[2:]) == 0
    transient.newton.matrix.rate = 0.9
    later = [next(steps).report for _ in range(20)]
    transient.close()
    assert sum(report.factorisations for report in later) == 1
    assert sum(report.iterations for report in later) <= 60


def begun(steps: int, **keys: object) -> pairsim.RunResult:
    """The first steps of a soft pair in a viscoelastic liquid."""
    case = {"beta": 0.4, "De": 1, "Ca_e": 0.1, "length": 3, "mesh": {"Np": 10, "max_size": 0.2, "rows": 0}, **keys}
    run = pairsim.run({**case, "time": {"end": steps * 7.5e-4, "fixed_step": 7.5e-4}, "output": {"fields": False}})
    run.check()
    return run


@pytest.mark.slow
@pytest.mark.parametrize(
    "keys",
    [
        pytest.param({"d0": 0.005}, id="narrow gap"),
        pytest.param({"beta": 0.6, "Ca_e": 0.05, "d0": 0.1, "ends": "developed"}, id="developed ends"),
    ],
)
def test_first_step_from_rest_converges(keys: dict[str, object]) -> None:
    """From a first guess that shears the cells in the gap or at the ends Newton's method diverges."""
    assert begun(1, **keys).table["newton"].item() <= 5


@pytest.mark.slow
def test_a_step_that_fails_with_an_earlier_matrix_is_solved_with_its_own() -> None:
    """The third step begins with the matrix of the second one, with which its steps grow."""
    record = begun(3, d0=0.02).record
    assert (record["steps"], record["rejected_steps"], record["remeshings"]) == (3, 0, 0)


def test_forms_have_the_same_signature_in_every_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """UFL sorts constants by their count as text; where 99 becomes 100 the forms were compiled twice."""
    found: list[str] = []

    def seen(comm: MPI.Comm, form: ufl.Form, **_: Any) -> None:
        found.append(form.signature())
        raise KeyboardInterrupt  # which nothing on the way takes for a cache that cannot be written

    monkeypatch.setattr(compiled_phase, "_COMPILED", {})
    monkeypatch.setattr(compiled_phase.fem, "compile_form", seen)
    for made_before in (50, *range(90, 100)):
        monkeypatch.setattr(ufl.Constant, "_counter", itertools.count(made_before))
        with pytest.raises(KeyboardInterrupt):
            compiled_phase.liquid_phase(TWO_MODES, moving=True)
    assert len(set(found)) == 1

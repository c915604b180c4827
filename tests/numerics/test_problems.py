"""Problems are made of a case: what drives its liquid and particles reaches every one of them as one object."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, field, replace

import pytest

from pairsim.cases.case import SceneCase
from pairsim.cases.run_case import Case
from pairsim.computing.problems import problem_of, steady_problem
from pairsim.fem.diagnostics import liquid_distortion
from pairsim.physics.drive import PER_PARTICLE, Drive
from pairsim.questions.curve import CurveCase
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.scene import LEAST_STEADY, SteadySolver
from pairsim.solvers.transient.start import steady_scene

PAIR = {"beta": 0.4, "Ca_e": 0, "mesh": {"Np": 8}}


@dataclass(frozen=True)
class Pull(Drive):
    """A drive with a force on each particle."""

    forces: tuple[float, ...] = field(default=(), metadata=PER_PARTICLE)


@pytest.fixture
def pulled(monkeypatch: pytest.MonkeyPatch) -> Pull:
    """What drives all cases, as a key that they share might."""
    pull = Pull(forces=(1.0, 2.0))
    monkeypatch.setattr(SceneCase, "drive", pull)
    return pull


def test_a_drive_reaches_runs_curves_and_the_starts_of_runs(pulled: Pull) -> None:
    run = problem_of(Case.model_validate(PAIR | {"d0": 0.1, "start": "steady"}))
    assert run.drive == pulled
    assert steady_scene(run, (0.1,))[0].drive == pulled
    assert steady_problem(CurveCase.model_validate(PAIR | {"d": [0.1]}), 0.1).drive == pulled


def test_a_curve_that_moves_its_particles_keeps_what_else_drives_them(pulled: Pull) -> None:
    moved = CurveCase.model_validate(PAIR | {"d": [0.1], "velocity": 2, "flow": 0})
    assert moved.drive == replace(pulled, flow=0.0, velocity=2.0)


def test_a_force_of_zero_on_each_particle_is_none(pulled: Pull) -> None:
    assert Pull(forces=(0.0, 0.0)).is_flow_alone
    assert not pulled.is_flow_alone
    assert not Pull(velocity=0.0).is_flow_alone


def test_what_each_particle_has_is_repeated_with_the_particles(pulled: Pull) -> None:
    twice = steady_problem(CurveCase.model_validate(PAIR | {"d": [0.1], "beta": [0.4, 0.3]}), 0.1).repeated(2)
    assert twice.betas == (0.4, 0.3, 0.4, 0.3)
    assert twice.drive == replace(pulled, forces=(1.0, 2.0, 1.0, 2.0))


@pytest.mark.parametrize(("d", "made_for"), [(1.2, 1.0), (6.0, 10**0.8), (7.0, 7.0), (8.0, 8.0)])
def test_cells_around_pairs_far_apart_follow_the_distance_without_being_inverted(d: float, made_for: float) -> None:
    """Those made for a distance of 10 are inverted at 8."""
    case = CurveCase.model_validate({"beta": 0.2, "De": 0.1, "Ca_e": 0, "d": [d], "mesh": {"Np": 8}})
    problem = steady_problem(case, d)
    assert problem.nominal((d,)) == pytest.approx((made_for,))
    steady = SteadySolver(problem, Parameters((d,), case.solid_models, case.liquid_model))
    with closing(steady):
        cells = steady.meshed.displaced(steady.h_star(steady.parameters))
        assert liquid_distortion(steady.scene, cells) > LEAST_STEADY

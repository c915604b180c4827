"""Runs that start from a quasi-steady state, against those from rest and against the state itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import problem_of
from pairsim.physics.pipe import Pipe
from pairsim.questions.registry import QUESTIONS
from pairsim.solvers.curves.point import Point
from pairsim.solvers.goals import D_OF_EACH, U, dU
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.transient.adaptation import AIM, RunAdaptation
from pairsim.solvers.transient.end import settled
from pairsim.solvers.transient.transient import Transient

SOFT = {"beta": 0.4, "De": 0, "Ca_e": 0.05, "d0": 0.1, "mesh": {"Np": 12}}
ELASTIC = {"beta": 0.4, "De": 0.25, "Ca_e": 0, "d0": 0.1, "mesh": {"Np": 12, "max_size": 0.1}}
BOTH = {**ELASTIC, "Ca_e": 0.05}
UNEQUAL = {**ELASTIC, "beta": [0.4, 0.3]}
SHORT = {"ends": "developed", "length": 3}


def steps_of(keys: dict[str, Any], end: float, **more: Any) -> list[Step]:
    """All steps of a run up to a time."""
    case = {**SHORT, **keys, **more, "time": {"end": end}}
    transient = Transient(problem_of(parse_case(QUESTIONS["run"], case, "test")))
    try:
        return list(transient.steps(iter([end])))
    finally:
        transient.close()


def settled_at(keys: dict[str, Any], gaps: tuple[float, ...]) -> Point:
    """The quasi-steady solution on the cells of a run."""
    return settled(problem_of(parse_case(QUESTIONS["run"], {**SHORT, **keys}, "test")), gaps)[0]


@pytest.mark.parametrize(
    ("keys", "ends"),
    [
        pytest.param(SOFT, "developed", id="soft"),
        pytest.param(SOFT, "periodic", id="soft, periodic"),
        pytest.param(BOTH, "periodic", id="soft in a viscoelastic liquid, periodic", marks=pytest.mark.slow),
        pytest.param(UNEQUAL, "developed", id="unequal, rigid", marks=pytest.mark.slow),
    ],
)
def test_first_dU_is_that_of_the_curve(keys: dict[str, Any], ends: str) -> None:
    """At held distance: the surfaces do not know yet that it changes. Nothing jumps in the steps that follow."""
    keys = {**keys, "ends": ends}
    steps = steps_of(keys, 0.01, start="steady")
    point = settled_at(keys, (0.1,))
    assert steps[0].observation.dU == pytest.approx(point.discrete.dU, rel=2e-3)
    for step in steps:  # its error is known without being asked for; nothing is added
        assert not step.corrections
        for goal in (dU, U):
            estimate = point.estimate[goal]
            assert (step.half_widths[goal] > 0.95 * (np.abs(estimate.correction) + estimate.half_width)).all()
        assert (step.half_widths[D_OF_EACH] > 0).all() == (keys["Ca_e"] > 0)
    velocities = np.array([step.observation.dU[0] for step in steps])
    assert np.ptp(velocities) < 0.02 * abs(velocities[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    "keys",
    [
        pytest.param(SOFT, id="soft"),
        pytest.param(BOTH, id="soft in a viscoelastic liquid", marks=pytest.mark.long),
        pytest.param({**ELASTIC, "mesh": {"Np": 8, "max_size": 0.2}}, id="rigid"),
    ],
)
def test_ten_relaxation_times_after_rest_the_start_is_forgotten(keys: dict[str, Any]) -> None:
    """Runs from rest and from a quasi-steady state have then dU of quasi-steady motion at their distances."""
    end = 10 * settled_at(keys, (0.1,)).t_relax
    for start in ("rest", "steady"):
        last = steps_of(keys, end, start=start)[-1].observation
        point = settled_at(keys, tuple(last.d))
        assert last.dU == pytest.approx(point.dUs - point.correction, rel=0.01), start
        assert abs(last.dU - point.dUs + point.correction) < point.dU_errors, start


@pytest.mark.slow
def test_a_single_particle_and_the_tube_alone_start_as_they_go_on() -> None:
    law = {"De": 0.5, "start": "steady", "mesh": {"Np": 12, "max_size": 0.15}}
    U = [float(step.observation.U[0]) for step in steps_of({"particles": 1, "beta": 0.4, "Ca_e": 0.1, **law}, 0.1)]
    assert np.ptp(U) < 1e-8
    for ends in ("developed", "periodic"):
        tube = {"particles": 0, **law, "mesh": {"max_size": 0.07}, "ends": ends}
        dp = [step.observation.dp for step in steps_of(tube, 0.03)]
        assert np.ptp(dp) < 1e-8 * dp[0]
        liquid = parse_case(QUESTIONS["run"], {**SHORT, **tube}, "test").liquid_model
        assert dp[0] == pytest.approx(3 * Pipe(liquid).steady().gradient, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("start", ["steady", "rest"])
def test_error_of_the_settled_state_is_part_of_the_errors(start: str) -> None:
    """The estimate that a run carries forward begins with exact stresses and positions, which a curve has not.

    A run from rest goes to that state in a relaxation time.
    """
    case = {**SHORT, **UNEQUAL, "start": start, "dU_error": True}
    transient = Transient(problem_of(parse_case(QUESTIONS["run"], case, "test")))
    try:
        errors = transient.state.error_history
        assert errors is not None
        point = settled_at(UNEQUAL, (0.1,))
        estimate = point.estimate[dU]
        expected = np.abs(estimate.correction) + estimate.half_width  # a run begins with the discrete dU
        interval = transient.run_errors[dU].interval
        assert interval.start == pytest.approx(expected, rel=0.05)
        assert interval.setting_in == (UNEQUAL["De"] if start == "rest" else 0)
        assert not errors.h[0].any()
    finally:
        transient.close()


@pytest.mark.slow
def test_cells_of_a_run_from_rest_are_made_for_the_state_that_it_goes_to() -> None:
    """A coarse run does not see the scatter of this state, which on its cells is twice as large as it may be."""
    case = {**SHORT, **ELASTIC, "dU_error": True, "time": {"end": 0.05}}
    problem = problem_of(parse_case(QUESTIONS["run"], case, "test"))
    exact = RunAdaptation.begin(problem, 1.0)
    assert exact is not None
    errors = exact.settled[dU.name]
    wanted = float(np.max(errors)) * -np.expm1(-0.05 / 0.25) / (AIM * exact.dU)
    finer = RunAdaptation.begin(problem, wanted)
    assert finer is not None
    assert finer.factor < exact.factor
    assert (finer.settled[dU.name] < errors).all()
    assert (finer.settled[dU.name] * -np.expm1(-0.05 / 0.25) <= AIM * wanted * finer.dU / 2).all()

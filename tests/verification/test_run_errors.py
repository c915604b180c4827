"""The error equation of runs: its parts against what they are exact for, and its estimate against finer cells."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import numpy as np
import pytest

from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import problem_of
from pairsim.fem.meshes.six_node_mesh import shape_values
from pairsim.fem.recovery.enriched_nodes import EnrichedNodes, nodes_of
from pairsim.fem.recovery.enriched_residual import EnrichedUnknowns
from pairsim.fem.recovery.enriched_scene import EnrichedScene
from pairsim.fem.recovery.patch_recovery import WIDE, PatchRecovery
from pairsim.fem.recovery.recovered_solution import RecoveredSolution
from pairsim.questions.registry import QUESTIONS
from pairsim.solvers.goals import D_OF_EACH, DP_PLUS_IN_TIME, IN_TIME, Goal, U, dU
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.transient.transient import Transient

SOFT = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1}
UNEQUAL = {"beta": [0.4, 0.3], "De": 0.5, "Ca_e": 0, "d0": 0.1}
SHORT = {"ends": "developed", "length": 4, "dU_error": True}


def transient_of(keys: dict[str, Any], fixed: float, **mesh: float) -> Transient:
    """Equal steps: those of a run and of one on finer cells have the same error."""
    case = parse_case(QUESTIONS["run"], {**SHORT, **keys, "mesh": mesh, "time": {"fixed_step": fixed}}, "test")
    return Transient(problem_of(case))


def steps_of(keys: dict[str, Any], fixed: float, end: float, **mesh: float) -> list[Step]:
    """All steps up to a time."""
    transient = transient_of(keys, fixed, **mesh)
    steps = list(transient.steps(iter([end])))
    transient.close()
    return steps


@pytest.fixture(scope="module")
def followed() -> list[tuple[Step, dict[Goal, float]]]:
    """The steps of a soft pair, and the errors of its goals by the time steps."""
    with closing(transient_of(SOFT, 0.02, Np=14)) as transient:
        errors = transient.run_errors
        return [(step, {goal: errors[goal].steps.largest for goal in IN_TIME}) for step in transient.steps(iter([0.3]))]


@pytest.fixture(scope="module")
def soft(followed: list[tuple[Step, dict[Goal, float]]]) -> list[Step]:
    return [step for step, _ in followed]


@pytest.fixture(scope="module")
def finer() -> list[Step]:
    return steps_of(SOFT, 0.02, 0.3, Np=32)


@pytest.mark.parametrize("degree", [2, 3])
def test_recovery_adds_what_a_polynomial_has_beyond_the_space(soft: list[Step], degree: int) -> None:
    """At all nodes of one degree higher, for fields even and odd in r."""
    mesh, points = soft[0].scene.liquid.six_node_mesh, nodes_of(degree)
    nodes = EnrichedNodes(mesh, degree)
    recovery = PatchRecovery(nodes, WIDE[degree])
    x = np.einsum("qa,mak->mqk", shape_values(points), mesh.points[mesh.cells])
    shapes = shape_values(points) if degree == 3 else np.column_stack([1 - points.sum(axis=1), points])
    for odd in (False, True):

        def field(at: np.ndarray, odd: bool = odd) -> np.ndarray:
            z, r = at[..., 0], at[..., 1]
            even = 0.3 + z - z**2 + 2 * r**2 + (degree == 3) * (z**3 - z * r**2)
            return np.asarray(r * (1 - z + (degree == 3) * (z**2 + r**2)) if odd else even)

        nodal = field(mesh.points)
        own = nodal[mesh.cells[:, : shapes.shape[1]]] @ shapes.T
        assert np.abs(own + recovery.added(nodal, odd)[nodes.numbers] - field(x)).max() < 1e-8


def test_nodes_along_an_interface_are_the_same_on_both_sides(soft: list[Step]) -> None:
    """In the order of the outline, also where cells of liquid and solid lie differently at it."""
    scene = soft[0].scene
    body = scene.bodies[0]
    assert body.phase is not None
    found = []
    for phase, line in ((scene.liquid, scene.nodes.interfaces[0]), (body.phase, body.nodes)):
        mesh = phase.six_node_mesh
        nodes = EnrichedNodes(mesh, 3)
        x = np.zeros((nodes.count, 2))
        x[nodes.numbers] = np.einsum("qa,mak->mqk", shape_values(nodes_of(3)), mesh.points[mesh.cells])
        found.append(x[nodes.along(line)])
    shift = found[0][0] - found[1][0]
    assert np.abs(found[0] - found[1] - shift).max() < 1e-12
    assert len(found[0]) == 3 * (len(body.nodes) // 2) + 1


def test_without_additions_the_residual_is_that_of_the_phase(soft: list[Step]) -> None:
    last = soft[-1]
    for phase, start in zip(last.scene.phases, last.scene.offsets[:-1], strict=True):
        x = last.x[start : start + phase.size]
        phase.set(x)
        expected = phase.residual()
        found = EnrichedUnknowns(phase).assemble(x, {}, None, {})
        assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()


def compared(coarse: list[Step], finer: list[Step]) -> tuple[np.ndarray, np.ndarray]:
    """Errors of dU at all steps against finer cells, and their estimates."""
    errors = np.array([(b.observation.dU - a.observation.dU)[0] for a, b in zip(coarse, finer, strict=True)])
    return errors, np.array([step.corrections[dU][0] for step in coarse])


@pytest.mark.slow
def test_error_of_a_soft_pair(soft: list[Step], finer: list[Step]) -> None:
    """The estimate follows the error through its changes of sign, against cells that leave a twentieth of it."""
    errors, estimates = compared(soft, finer)
    assert np.abs(errors).max() > 1e-5
    assert np.corrcoef(errors, estimates)[0, 1] > 0.97
    assert 0.7 < (errors @ estimates) / (errors @ errors) < 1.6


def observed(goal: Goal, step: Step) -> np.ndarray:
    """The values of a goal of the discrete solution of a step."""
    o = step.observation
    return {U: o.U, D_OF_EACH: o.D, DP_PLUS_IN_TIME: np.array([o.dp_plus])}[goal]


@pytest.mark.slow
@pytest.mark.parametrize("goal", [U, D_OF_EACH, DP_PLUS_IN_TIME], ids=lambda goal: goal.name)
def test_errors_of_velocities_shapes_and_pressure_drop(
    followed: list[tuple[Step, dict[Goal, float]]], finer: list[Step], goal: Goal
) -> None:
    """Half-widths hold them without their part of the time steps, which are the same on the finer cells."""
    pairs = list(zip([step for step, _ in followed], finer, strict=True))
    values = np.array([[observed(goal, step) for step in pair] for pair in pairs])
    errors = values[:, 1] - values[:, 0]
    estimates = np.array([a.corrections[goal] for a, _ in pairs])
    widths = np.array([step.half_widths[goal] - by_steps[goal] for step, by_steps in followed])
    left = errors - estimates if goal.added else errors
    assert np.abs(errors).max() > 1e-5 * np.abs(values[:, 1]).max()
    assert (np.abs(left) < widths).all()
    assert widths.max() < 20 * np.abs(errors).max()
    if not goal.of_positions:  # an estimate of shapes tells their size alone, and is not added
        assert np.linalg.norm(errors - estimates) < 0.8 * np.linalg.norm(errors)


@pytest.mark.slow
def test_errors_of_the_past_are_carried_like_a_difference_of_two_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a defect, an error of stress and distance at t = 0 grows as a run that starts with it departs."""

    def nothing(enriched: EnrichedScene[EnrichedUnknowns], *_: object) -> RecoveredSolution:
        return RecoveredSolution(enriched, *([{} for _ in enriched.phases] for _ in range(2)))

    monkeypatch.setattr(RecoveredSolution, "of", nothing)
    found = []
    for perturbed in (False, True):
        transient = transient_of(UNEQUAL, 0.01, Np=8, max_size=0.3)
        scene, history = transient.scene, transient.history
        error, nodes = np.zeros(scene.size), scene.liquid.six_node_mesh.points
        free = np.abs(nodes[:, 0]) < 1.5
        for c, size in enumerate((2e-4, 1e-4, -1e-4, 1e-4)):
            error[scene.liquid.index("s", np.flatnonzero(free), c)] = size * np.cos(nodes[free, 0])
        shift = np.array([0.0, 1e-5])
        assert transient._error is not None
        if perturbed:
            history.x, history.h = [history.x[0] + error], [history.h[0] + shift]
        else:
            transient._error.errors.x, transient._error.errors.h = [error], [shift]
        rows = []
        for step in transient.steps(iter([0.08])):
            rows.append((float(step.observation.dU[0]), float(step.corrections[dU][0])))
            transient._due = len(rows) == 5  # a remeshing carries the errors over
        transient.close()
        found.append(np.array(rows))
    assert len(found[0]) == 8
    departure = found[1][:, 0] - found[0][:, 0]
    assert found[0][:2, 1] == pytest.approx(departure[:2], rel=1e-3)
    assert found[0][:, 1] == pytest.approx(departure, rel=0.1)  # what one iteration a step leaves


def test_steps_have_dU_and_its_error_without_the_command(soft: list[Step]) -> None:
    """dU contains the estimate, as it does in series.csv; the interval holds at least what is corrected."""
    for step in soft:
        assert step.dU == pytest.approx(step.dU_discrete + step.corrections[dU], rel=1e-9)
        assert (step.half_widths[dU] >= 2 * np.abs(step.corrections[dU])).all()


def test_scatter_of_a_viscosity_where_the_shear_rate_vanishes() -> None:
    """The error equation alone sees too little of it. Rigid spheres have no past: dU is 5.1291e-3 on N_p 56."""
    thin = {"beta": [0.4, 0.38], "De": 0, "Ca_e": 0, "d0": 0.1, "liquid": {"law": "power-law", "n": 0.6}}
    step = steps_of(thin, 1e-3, 2e-3, Np=12, max_size=0.14, rows=1.0)[-1]
    left = abs(5.1291e-3 - step.dU[0])
    assert 2 * abs(step.corrections[dU][0]) < left < step.half_widths[dU][0] < 10 * left

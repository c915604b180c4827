"""How much work fixed solves take: a change of it is to be seen, and meant.

Quasi-steady counts are asserted exactly; in runs, where rounding may move the size of a step, one step and
factorisation and three in a hundred iterations more or fewer are let pass. The meshes are those of gmsh 4.15.2.
"""

from __future__ import annotations

import pytest

from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import problem_of, steady_problem
from pairsim.questions.registry import QUESTIONS
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.curve import trace
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.transient.transient import Transient

PAIR = {"beta": 0.4, "ends": "developed", "length": 4.0, "mesh": {"Np": 8, "max_size": 0.2}}


@pytest.mark.parametrize(
    ("keys", "points", "iterations", "factorisations", "meshes"),
    [
        pytest.param({"De": 0, "Ca_e": 0, "d": [0.1]}, 1, 3, 2, 1, id="rigid point"),
        pytest.param({"De": 0, "Ca_e": 0.1, "d": [0.1]}, 1, 16, 8, 4, id="soft point"),
        pytest.param({"De": 1, "Ca_e": 0.1, "d": [0.1]}, 1, 15, 9, 2, id="De 1 point"),
        pytest.param({"De": 0, "Ca_e": 0.1, "d": [0.1, 0.2, 0.4]}, 3, 32, 16, 6, id="curve", marks=pytest.mark.slow),
    ],
)
def test_work_of_quasi_steady_points(
    keys: dict[str, object], points: int, iterations: int, factorisations: int, meshes: int
) -> None:
    case = parse_case(QUESTIONS["curve"], {**PAIR, **keys}, "test")
    places = case.in_order
    problem = steady_problem(case, min(place[0] for place in places))
    start = Parameters(places[0], case.solid_models, case.liquid_model)
    branch = Branch(arrived(first_scene(problem, start)))
    try:
        found = list(trace(branch, places, 1.0, len(places)))
        fine = branch.solver
        work = (len(found), fine.iterations, fine.factorisations, fine.meshes)
        assert work == (points, iterations, factorisations, meshes)
    finally:
        branch.close()


@pytest.mark.parametrize(
    ("De", "end", "attempts", "iterations", "factorisations"),
    [
        pytest.param(0, 0.2, 50, 141, 12, id="Newtonian"),
        pytest.param(1, 0.02, 47, 248, 15, id="De 1", marks=pytest.mark.slow),
    ],
)
def test_work_of_runs(De: float, end: float, attempts: int, iterations: int, factorisations: int) -> None:
    case = parse_case(QUESTIONS["run"], {**PAIR, "De": De, "Ca_e": 0.1, "d0": 0.1, "time": {"end": end}}, "test")
    transient = Transient(problem_of(case))
    try:
        list(transient.steps(iter([end])))
    finally:
        transient.close()
    counts = transient.counts
    assert counts.remeshings == 0
    assert counts.steps + counts.rejected == pytest.approx(attempts, abs=1)
    assert counts.newton == pytest.approx(iterations, rel=0.03)
    assert counts.factorisations == pytest.approx(factorisations, abs=1)

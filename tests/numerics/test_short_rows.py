"""Short rows that are solved, of which the model of long ones is made."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, product

import numpy as np
import pytest

import pairsim
from pairsim.computing.problems import steady_problem
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.solids import soft
from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.deviations import deviations
from pairsim.solvers.rows.model import Row
from pairsim.solvers.rows.row_branch import RowBranch
from pairsim.solvers.rows.short_rows import APART, places_of, short_rows, solved, unequal_rows
from pairsim.solvers.steady.scene import Snapshot, SteadySolver


def short(count: int, places: list[tuple[float, ...]], parts: np.ndarray | None = None) -> list[Row]:
    """Rows of soft particles in a Newtonian liquid, on few cells."""
    problem = SteadyProblem(betas=(0.4,), length=8.0, periodic=True, mesh=MeshSettings(Np=10))
    alone = Parameters((), soft(0.1))
    assert all(len(place) == count - 1 for place in places)
    return list(solved(problem, alone, places, parts is not None, parts))


def test_a_particle_far_downstream_changes_no_length() -> None:
    """The length of the last one is that of one which is followed by another far from it."""
    (alone,) = short(1, [()])
    (pair,) = short(2, [(0.12,)])
    (triplet,) = short(3, [(0.12, 1.5)])
    lengths = [row.followed(alone.rear).values[:, 1] for row in (alone, pair, triplet)]
    assert lengths[2][:2] == pytest.approx(lengths[1], abs=3e-4)
    assert abs(lengths[1][1] - lengths[0][0]) > 2e-3, "the front of the second one is another one in a pair"


def test_what_the_size_of_a_rigid_particle_changes_is_what_it_changes_of_two_that_are_far_apart() -> None:
    problem = SteadyProblem(betas=(0.4,), length=8.0, periodic=True, mesh=MeshSettings(Np=10))
    rigid = Parameters((), (None,))
    (alone,), (pair,) = (list(solved(problem, rigid, [place], True)) for place in ((), (1.2,)))
    assert alone.by_particle is not None
    assert pair.by_particle is not None
    assert alone.by_particle[0, 0] == pytest.approx([-0.405, 0.0], abs=0.01)
    assert pair.by_particle[0, 0] == pytest.approx(alone.by_particle[0, 0], abs=0.004)


def test_what_size_and_softness_change_of_one_particle_is_known_to_second_order() -> None:
    rows = [short(1, [()], sign * APART * each[None])[0] for each in np.eye(2) for sign in (1, -1)]
    (equal,) = short(1, [()], np.zeros((1, 2)))
    found = deviations(equal, [], rows, [], 0.04)
    for parts in (np.array([[0.1, 0.0]]), np.array([[-0.1, 0.2]])):
        (other,) = short(1, [()], parts)
        change, first = (other.U - equal.U)[0], float((parts @ found.alone)[0])
        twice = found.velocities(np.zeros(0), parts)[0]
        assert abs(twice - change) < 0.2 * abs(first - change)


def test_the_lag_of_shapes_is_that_of_a_run() -> None:
    """Centres of a pair in motion are farther apart than of one held at the same distance, by a little less than l."""
    sizes, keys = np.log([[0.38 / 0.4], [0.42 / 0.4]]), {"ends": "periodic", "length": 8.0, "mesh": {"Np": 10}}
    pair = {"particles": 2, "beta": [0.38, 0.42], "d0": 0.1, "De": 0.0, "Ca_e": 0.1, "accuracy": "5%"}
    run = pairsim.run({**pair, **keys, "start": "steady", "time": {"end": 2.0}, "output": {"fields": False}})
    last = run.table.iloc[-1]
    (held,) = short(2, [(last["d"],)], np.hstack([sizes, np.zeros((2, 1))]))
    assert held.lag is not None
    lag = abs(last["z_T"] - last["z_L"]) - last["d"] - held.values[0, 1]
    assert lag > 0.002
    assert 0.6 * held.lag[0] < lag < held.lag[0]  # it is known to first order
    (alone,) = short(1, [()])
    assert alone.lag is None


def test_a_row_goes_on_from_the_one_from_which_all_distances_shrink(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not from the last one, from which one distance would grow while the other shrinks."""
    recalled, recall = list[tuple[float, ...]](), SteadySolver.recall

    def recording(solver: SteadySolver, snapshot: Snapshot) -> None:
        recalled.append(snapshot.parameters.gaps)
        recall(solver, snapshot)

    monkeypatch.setattr(SteadySolver, "recall", recording)
    wide, *_ = short(3, [(0.3, 0.3), (0.3, 0.08), (0.08, 0.3)])
    assert recalled == [tuple(wide.gaps)]


def test_beads_come_closer_as_far_as_it_can_be_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of beads that differ, by a pair of which the first one is smaller; other rows must be solved."""
    *others, closing = unequal_rows(True, 0.04)
    assert [chain.may_end for chain in others] == [False] * len(others)
    assert closing.parts is not None
    assert closing.parts[0, 0] < 0 < closing.parts[1, 0]
    assert closing.places[0][0] > 0.04 > closing.places[-1][0]
    problem = SteadyProblem(betas=(0.4,), length=8.0, periodic=True, mesh=MeshSettings(Np=10))
    alone = Parameters((), soft(0.1))
    solving = RowBranch.at

    def not_so_near(branch: RowBranch, parameters: Parameters) -> object:
        if min(parameters.gaps) < 0.03:
            raise NoSteadyState("too near")
        return solving(branch, parameters)

    monkeypatch.setattr(RowBranch, "at", not_so_near)
    rows = list(closing.solved(problem, alone))
    assert [float(row.gaps[0]) for row in rows] == pytest.approx([0.08, 0.06, 0.04, 0.03])
    assert all(row.rates[0] < 0 for row in rows)
    with pytest.raises(NoSteadyState, match="too near"):
        list(replace(closing, may_end=False).solved(problem, alone))


def test_rows_of_four_have_each_combination_of_two_distances_once() -> None:
    places = places_of(4, 0.04)
    distances = {d for place in places for d in place}
    assert len(distances) == 3
    for i, j in combinations(range(3), 2):
        assert sorted((place[i], place[j]) for place in places) == sorted(product(distances, repeat=2))


@pytest.mark.parametrize(("De", "Np"), [(0.0, 20), (1.0, 14)])
def test_more_than_three_particles_have_larger_cells_in_a_liquid_with_a_memory(
    De: float, Np: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = pairsim.load({"beta": 0.4, "De": De, "Ca_e": 0.1, "d": 0.3, "mesh": {"Np": 20}}, kind="train")
    problem, alone = steady_problem(case, np.inf), Parameters((), case.solid_models, case.liquid_model)
    cells = list[int]()

    def first(problem: SteadyProblem, _: Parameters) -> None:
        cells.append(problem.mesh.Np)
        raise NoSteadyState("its cells are known")

    monkeypatch.setattr("pairsim.solvers.rows.short_rows.first_scene", first)
    for chain in short_rows(0.04):
        with pytest.raises(NoSteadyState):
            next(chain.solved(problem, alone))
    assert cells == [20, 20, 20, Np, Np]

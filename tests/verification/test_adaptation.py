"""Meshes that follow from the error wanted: it is kept, the estimate holds, and what could not be kept is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import steady_problem
from pairsim.fem.meshes.size_field import AdaptedSizes, SizeField
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves import adaptation
from pairsim.solvers.curves import branch as branch_module
from pairsim.solvers.curves.adaptation import ROUNDS, AdaptiveBranch
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.point import Point
from pairsim.solvers.curves.scout import largest_value
from pairsim.solvers.errors import estimate
from pairsim.solvers.goals import CRITICAL, DP_PLUS, D, F, Goal, U, dU
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.steady.linearisation import Linearisation

TUBE = {"beta": 0.4, "d": [0.4], "ends": "developed", "length": "auto"}


def adaptive(wanted: float, goal: Goal = dU, **keys: object) -> tuple[AdaptiveBranch, Parameters]:
    """A branch on the cells of a case; those given are not held."""
    case = parse_case(QUESTIONS["curve"], TUBE | keys, "test")
    first = Parameters(case.places[0], case.solid_models, case.liquid_model)
    problem = steady_problem(case, first.gaps[0])
    scene = arrived(first_scene(problem, first))
    return AdaptiveBranch(scene, goals=(goal,), wanted=wanted, places=case.places), first


@pytest.mark.slow
def test_points_that_decide_about_cells_alone_have_no_decay_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes as long as half a solution, and is that of the last point of a distance; zeros of curves have none."""
    asked: list[tuple[float, ...]] = []

    def counted(at: Linearisation) -> float:
        asked.append(at.parameters.gaps)
        return 0.2

    monkeypatch.setattr(branch_module, "relaxation_time", counted)
    branch, first = adaptive(1e-2, beta=0.2, De=0, Ca_e=0.1, d=[0.1], mesh={"Np": 8})
    with closing(branch):
        point = branch.at(first)
        assert max(branch.rounds.values()) >= 1
        assert point.complete
        assert asked == [(0.1,)]
        branch.wanted = np.inf
        zero = branch.zero(0.045, 0.08, 0.055)
        assert zero is not None
        assert np.isnan(zero.t_relax)
        assert asked == [(0.1,)]


@pytest.mark.slow
def test_a_newtonian_error_is_kept_by_smaller_cells() -> None:
    truth, wanted = 6.7851e-3, 2e-3  # N_p 80
    branch, first = adaptive(wanted, De=0, Ca_e=0.1, d=[0.1], mesh={"Np": 12})
    coarse = branch.solver.snapshot
    point = branch.at(first)
    assert point.estimate[dU].half_width[0] <= wanted * branch.largest[dU]
    assert abs(point.held_dUs[0] - truth) <= point.estimate[dU].half_width[0]
    assert 1 <= max(branch.rounds.values()) <= ROUNDS
    assert branch.unknowns[(0.1,)] == branch.solver.constraints.size
    branch.at(replace(first, gaps=(0.12,)))
    branch.recall(coarse)  # on cells that are no more
    assert branch.solver.parameters == first
    assert branch.solver.constraints.size > len(coarse.y)
    branch.close()


@pytest.mark.slow
def test_a_viscoelastic_error_is_kept_by_smaller_cells_where_they_count() -> None:
    """De 2, rigid: dU is known to .05 % (docs/explanation/decisions.md); equal cells of 27,000 unknowns leave .4 %."""
    truth, wanted = 3.107e-3, 0.008
    branch, first = adaptive(wanted, De=2, Ca_e=0)
    point = branch.at(first)
    assert point.estimate[dU].half_width[0] <= wanted * branch.largest[dU]
    assert abs(point.held_dUs[0] - truth) <= point.estimate[dU].half_width[0]
    assert branch.solver.constraints.size < 25_000
    assert max(branch.rounds.values()) == 1, "cells that do not resolve the stress widen the half-width, as is expected"
    assert isinstance(branch.problem.mesh.sizes, AdaptedSizes)
    other = branch.at(replace(first, gaps=(0.3,)))  # of another nominal distance: the cells move with the particles
    assert other.dU_errors[0] <= wanted * branch.largest[dU]
    branch.close()


@pytest.mark.slow
def test_all_cells_become_smaller_where_the_signed_part_of_the_error_prevails(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the scatter comes from says nothing of that part, which falls fast with the size of all cells.

    Not below .02 % by the half-width: what is left of parts that cancel falls with the square of the size alone.
    """
    monkeypatch.setattr(estimate, "ELASTIC", 0.0)
    truth, wanted = -3.8818e-4, 4e-4  # docs/explanation/decisions.md
    branch, first = adaptive(wanted, De=0.5, Ca_e=0.1, d=[0.2], mesh={"Np": 20, "max_size": 0.07})
    point = branch.at(first)
    assert max(branch.rounds.values()) >= 1
    assert branch.problem.mesh.sizes is None
    assert point.estimate[dU].half_width[0] <= wanted * branch.largest[dU]
    assert abs(point.held_dUs[0] - truth) < 5e-4 * branch.largest[dU]
    branch.close()


@pytest.mark.slow
def test_what_cannot_be_kept_ends_with_the_error_arrived(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adaptation, "ROUNDS", 1)
    branch, first = adaptive(1e-7, De=0, Ca_e=0.1, d=[0.1], mesh={"Np": 6})
    before = branch.solver.constraints.size
    point = branch.at(first)
    assert point.dU_errors[0] > 1e-7 * branch.largest[dU]
    assert branch.solver.constraints.size > 2 * before
    branch.close()


@pytest.mark.slow
def test_a_finer_mesh_with_a_larger_error_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """As near the softest shapes, where fine cells resolve wrinkles."""
    branch, first = adaptive(1e-7, De=0, Ca_e=0.1, d=[0.1], mesh={"Np": 6})
    coarse, own = branch.solver.constraints.size, Branch._begun_at

    def worse_on_finer_cells(self: Branch, parameters: Parameters) -> Point:
        point = own(self, parameters)
        widening = 1.0 if self.solver.constraints.size < 1.5 * coarse else 1e3
        widened = {goal: replace(each, widening=widening) for goal, each in point.estimate.items()}
        return replace(point, estimate=replace(point.estimate, goals=widened))

    monkeypatch.setattr(Branch, "_begun_at", worse_on_finer_cells)
    point = branch.at(first)
    assert branch.solver.constraints.size < 1.1 * coarse
    assert point.estimate[dU].widening == 1.0
    assert max(branch.rounds.values()) == ROUNDS
    branch.close()


@pytest.mark.slow
@pytest.mark.parametrize(("Ca_e", "d", "largest"), [(0.02, 0.8, 1.103e-3), (0.1, 2.0, 6.785e-3)])
def test_the_size_of_dU_at_a_single_distance_is_that_of_the_curve_it_lies_on(
    Ca_e: float, d: float, largest: float
) -> None:
    """Also of very soft particles far apart, whose solution on coarse cells does not follow from that on fine ones."""
    case = parse_case(QUESTIONS["curve"], TUBE | {"De": 0, "Ca_e": Ca_e, "d": [d], "mesh": {"Np": 18}}, "test")
    first = Parameters(case.places[0], case.solid_models, case.liquid_model)
    branch = Branch(arrived(first_scene(steady_problem(case, d), first)))
    known = dU, branch.solver, case.places
    assert largest_value(*known, np.inf) == pytest.approx(largest, rel=0.05), "finer cells, d = .1"
    assert largest_value(*known, 1e-4) < 0.95 * largest, "larger ones are not looked for"
    branch.close()


@pytest.mark.slow
def test_a_zero_is_improved_where_it_is() -> None:
    branch, _ = adaptive(1.0, goal=CRITICAL, beta=0.2, De=0, Ca_e=0.1, d=[0.1], mesh={"Np": 16})
    rough = branch.zero(0.045, 0.08, 0.055)
    assert branch.improved(rough) is rough
    branch.wanted = rough.dU_errors[0] / 3 / (abs(rough.slope_at_rest) * rough.d)
    better = branch.improved(rough)
    assert max(branch.rounds.values()) >= 1
    assert better.dU_errors[0] <= branch.allowed(CRITICAL, better)
    assert abs(better.dU) < 0.1 * better.dU_errors[0]
    assert better.d == pytest.approx(0.05542, rel=0.01), "accuracy: 0.7%"
    branch.close()


def test_errors_of_shapes_ask_for_smaller_cells_than_those_of_velocities() -> None:
    """For a quarter of its error a shape asks for cells of half the size."""
    keys = {"particles": 1, "beta": 0.4, "De": 0, "Ca_e": 0.1, "length": 5.0, "mesh": {"Np": 8}}
    case = parse_case(QUESTIONS["curve"], keys, "test")
    first = Parameters((), case.solid_models, case.liquid_model)
    scene = arrived(first_scene(steady_problem(case, np.inf), first))
    with closing(AdaptiveBranch(scene, goals=(D, U), wanted=np.inf)) as branch:
        point = branch.at(first)
        factors = {goal: branch._factor(point, {goal: point.estimate[goal].by_cells / 4}) for goal in (D, U)}
        assert factors == pytest.approx({D: 2.0, U: 4 ** (1 / 3)})
        assert branch._factor(point, {goal: point.estimate[goal].by_cells / 4 for goal in (D, U)}) == factors[D]


def test_no_cells_are_made_for_a_goal_that_three_rounds_would_not_do_for() -> None:
    """As for a pressure drop that nearly vanishes."""
    keys = {"particles": 1, "beta": 0.4, "De": 0, "Ca_e": 0.1, "length": 5.0, "mesh": {"Np": 8}}
    case = parse_case(QUESTIONS["curve"], keys, "test")
    first = Parameters((), case.solid_models, case.liquid_model)

    def rounds(wanted: float, *goals: Goal) -> int:
        branch = AdaptiveBranch(arrived(first_scene(steady_problem(case, np.inf), first)), goals=goals, wanted=wanted)
        point = branch.at(first)
        branch.close()
        kept = all((point.estimate[goal].half_width <= wanted * abs(point.values[goal])).all() for goal in goals)
        assert kept == (wanted > 0.01)
        return max(branch.rounds.values(), default=0)

    assert rounds(1e-6, DP_PLUS) == 0
    assert 1 <= rounds(0.1, DP_PLUS, D) <= ROUNDS


def dragged(wanted: float) -> tuple[AdaptiveBranch, Parameters]:
    """A branch with a sphere that is dragged through a viscoelastic liquid at rest, on coarse cells."""
    keys = {"particles": 1, "beta": 0.4, "De": 0.2, "Ca_e": 0, "velocity": 1, "flow": 0, "length": 4, "mesh": {"Np": 8}}
    case = parse_case(QUESTIONS["curve"], keys, "test")
    first = Parameters((), case.solid_models, case.liquid_model)
    return AdaptiveBranch(arrived(first_scene(steady_problem(case, np.inf), first)), goals=(F,), wanted=wanted), first


def test_cells_become_smaller_where_they_count_for_a_force_if_a_round_of_all_would_not_do() -> None:
    """Half-widths of .03 of the force are left by the first cells; all cells for .7 % have 20,000 unknowns."""
    for wanted, most in ((0.02, 13_000), (0.004, 11_000)):
        branch, first = dragged(wanted)
        with closing(branch):
            point = branch.at(first)
            assert point.estimate[F].half_width <= wanted * point.values[F]
            assert abs(point.values[F] - 7.4375) <= point.estimate[F].half_width
            assert branch.solver.constraints.size < most
            assert (branch.problem.mesh.sizes is None) == (wanted > 0.01)


def test_a_round_that_misses_by_far_what_it_was_made_for_is_the_last_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a wake that no cells resolve, where rounds of ever more cells took a quarter of an hour."""
    own_sizes, own_round, errors = AdaptiveBranch._sizes, AdaptiveBranch._refine, list[float]()

    def too_large(self: AdaptiveBranch, point: Point, most: Mapping[Goal, Array]) -> SizeField:
        return own_sizes(self, point, {goal: 4 * each for goal, each in most.items()})

    def counted(self: AdaptiveBranch, point: Point, goals: Sequence[Goal]) -> bool:
        errors.append(float(point.estimate[F].half_width[0]))
        return own_round(self, point, goals)

    monkeypatch.setattr(AdaptiveBranch, "_sizes", too_large)
    monkeypatch.setattr(AdaptiveBranch, "_refine", counted)
    branch, first = dragged(0.004)
    with closing(branch):
        left = branch.at(first).estimate[F].half_width
        assert len(errors) == 1
        assert 2 * 0.004 * 7.44 < left < adaptation.HELPS * errors[0], "it has helped"

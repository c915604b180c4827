"""The order in which unknowns are eliminated, and factors in single precision."""

from __future__ import annotations

from collections.abc import Iterator
from unittest.mock import MagicMock

import numpy as np
import pytest

from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import steady_problem
from pairsim.fem.algebra.constraints import PositionUpdate
from pairsim.fem.algebra.fill_reducing_ordering import dependence_on_unknowns, fill_reducing_ordering, node_of_unknowns
from pairsim.questions.registry import QUESTIONS
from pairsim.solvers.nonlinear import factors
from pairsim.solvers.nonlinear.factors import EXACT, Factors, MumpsOptions
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.continuation import begin
from pairsim.solvers.steady.linearisation import Linearisation
from pairsim.solvers.steady.scene import SteadySolver

KEYS = {"beta": 0.4, "De": 0, "Ca_e": 0.01, "d": [0.1], "ends": "developed", "length": 4.0, "mesh": {"Np": 8}}


def pair() -> SteadySolver:
    case = parse_case(QUESTIONS["curve"], KEYS, "test")
    return SteadySolver(steady_problem(case, 0.1), Parameters((0.1,), case.solid_models))


@pytest.fixture
def scene() -> Iterator[SteadySolver]:
    steady = pair()
    yield steady
    steady.close()


def solved(steady: SteadySolver) -> float:
    begin(steady)
    return float(steady.velocity_row() @ steady.y)


def test_unknowns_of_a_node_are_eliminated_together_and_those_of_all_nodes_last(scene: SteadySolver) -> None:
    order = fill_reducing_ordering(scene.scene, scene.constraints)
    assert order is not None
    assert np.array_equal(np.sort(order), np.arange(scene.constraints.size))
    node = node_of_unknowns(scene.scene, dependence_on_unknowns(scene.constraints))
    own = node[order]
    last = np.count_nonzero(node < 0)
    assert (own[-last:] < 0).all()
    assert np.count_nonzero(np.diff(own)) == len(np.unique(own)) - 1


def test_order_of_nodes_gives_factors_as_small_as_the_order_of_unknowns(
    scene: SteadySolver, monkeypatch: pytest.MonkeyPatch
) -> None:
    solved(scene)
    ours = scene.newton.factor_megabytes
    monkeypatch.setattr(factors, "fill_reducing_ordering", lambda *_: None)
    other = pair()
    solved(other)
    assert ours <= 1.1 * other.newton.factor_megabytes
    other.close()


def test_double_precision_takes_over_where_refinement_fails(
    scene: SteadySolver, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = solved(scene)
    assert scene.newton.single
    monkeypatch.setattr(factors, "MOST_REFINEMENTS", 1)
    other = pair()
    assert solved(other) == pytest.approx(expected, abs=1e-11), "to the tolerance of Newton's method"
    assert not other.newton.single
    other.close()


def solution(at: Linearisation, rhs: np.ndarray, transposed: bool) -> np.ndarray:
    """That of linear systems, to the same accuracy for both matrices."""
    return (at.adjoint if transposed else at.solve)(rhs, tolerance=EXACT)


@pytest.mark.parametrize("transposed", [False, True])
def test_linear_solves_are_refined(scene: SteadySolver, transposed: bool) -> None:
    solved(scene)
    row = scene.velocity_row()
    single = solution(scene.linearise(), row, transposed)
    assert scene.newton.single
    scene.newton.use_double()
    scene.forget()
    double = solution(scene.linearise(), row, transposed)
    assert np.linalg.norm(single - double) < 1e-6 * np.linalg.norm(double)


@pytest.mark.parametrize("transposed", [False, True])
def test_several_systems_are_solved_at_once(scene: SteadySolver, transposed: bool) -> None:
    solved(scene)
    at, rows = scene.linearise(), np.eye(scene.constraints.size)[scene.constraints.fields["U_p"]]
    together = solution(at, rows, transposed)
    apart = [solution(at, row, transposed) for row in rows]
    assert np.linalg.norm(together - apart) < 1e-6 * np.linalg.norm(together)


def test_factors_of_the_last_iterations_serve_at_the_solution(scene: SteadySolver) -> None:
    solved(scene)
    made = scene.newton.factorisations
    at = scene.linearise()
    assert scene.newton.factorisations == made
    assert scene.linearise() is at, "the solution and its parameters are the same"
    tangent = at.gap_tangents
    scene.forget()
    again = scene.linearise()
    assert scene.newton.factorisations == made + 1
    assert np.linalg.norm(again.gap_tangents - tangent) < 1e-6 * np.linalg.norm(tangent)


def test_a_linearisation_does_not_solve_with_the_matrix_of_another_solution(scene: SteadySolver) -> None:
    solved(scene)
    at = scene.linearise()
    assert scene.solve(scene.parameters.with_gap(0.11), scene.y + 0.01 * at.gap_tangents[0]).converged
    with pytest.raises(RuntimeError, match="gone on to another solution"):
        at.solve(at.residual)
    scene.linearise().solve(at.residual)


def test_parameters_that_were_changed_for_a_derivative_are_put_back(scene: SteadySolver) -> None:
    """Those of the liquid, the solids, the sizes and the distances, also where the computation with them fails."""
    solved(scene)
    here, left = scene.parameters, scene.linearise().residual
    update = PositionUpdate(scene.h_star(here))
    for other in (here.softer(1.1), here.resized([1.01, 1.01]), here.with_gap(0.12)):
        assert np.abs(scene.residual_at(other, scene.y) - left).max() > 1e-6
        assert np.array_equal(scene.newton.residual_at(scene.y, update), left)
        with pytest.raises(ZeroDivisionError), scene.changed_to(other):
            raise ZeroDivisionError
        assert np.array_equal(scene.newton.residual_at(scene.y, update), left)


def test_a_matrix_without_enough_workspace_is_not_regular() -> None:
    """After the last attempt there are no factors that could be asked, as MUMPS crashes if they are."""
    ksp = MagicMock()
    factors = Factors(MagicMock(options={}), ksp, "starved_", MumpsOptions(), single=True)

    def without_factors() -> None:
        ksp.getPC().getFactorMatrix.side_effect = AssertionError("there are no factors")

    def with_too_small_a_workspace() -> None:
        ksp.getPC().getFactorMatrix.side_effect = None
        ksp.getPC().getFactorMatrix().getMumpsInfog.return_value = -9

    ksp.reset.side_effect, ksp.setUp.side_effect = without_factors, with_too_small_a_workspace
    factors.make()
    assert not factors.regular

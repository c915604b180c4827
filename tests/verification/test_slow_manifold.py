"""Particles that move: their velocities on the slow manifold, and how long they remember."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.sparse.linalg import LinearOperator, gmres

import pairsim
from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import steady_problem
from pairsim.questions.registry import QUESTIONS
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.point import Point
from pairsim.solvers.curves.slow_manifold import REST, SlowMotion
from pairsim.solvers.goals import CRITICAL
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.steady.motion import ShapeRates, moving_residual, rate_terms
from pairsim.solvers.steady.relaxation import _late_time, relaxation_time

PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": 5.0, "mesh": {"Np": 12}}


def solved(**keys: Any) -> tuple[Branch, Point]:
    """A branch at the first distance of a case, and its point there."""
    case = parse_case(QUESTIONS["curve"], {**PAIR, "d": (0.1,), **keys}, "test")
    narrowest = min((d for place in case.places for d in place), default=np.inf)
    start = Parameters(case.places[0], case.solid_models, case.liquid_model)
    branch = Branch(arrived(first_scene(steady_problem(case, narrowest), start)), goals=(CRITICAL,))
    return branch, branch.at(start)


def point(**keys: Any) -> Point:
    branch, found = solved(**keys)
    branch.close()
    return found


def decays(branch: Branch, dt: float, steps: int) -> np.ndarray:
    """Decay times of dU in a run at held distance, from the shape that belongs to a larger distance, (steps - 1,).

    Steps of the implicit Euler method, with all rates; for a single exponential the time is that of the equations.
    """
    scene, here = branch.solver, branch.solver.parameters
    at = scene.linearise()
    still, held = at.y.copy(), np.zeros(len(here.gaps))
    y, dU = still + 1e-3 * at.gap_tangents.sum(axis=0), []
    row = scene.velocity_row()
    for _ in range(steps):
        before = y
        for _ in range(2):
            residual = moving_residual(scene, here, y, (y - before) / dt, held)

            def times(v: np.ndarray, y: Any = y, before: Any = before, residual: Any = residual) -> np.ndarray:
                e = 1e-5 / max(float(np.abs(v).max()), 1e-30)
                ahead = moving_residual(scene, here, y + e * v, (y + e * v - before) / dt, held)
                return np.asarray(at.solve((ahead - residual) / e))

            start = at.solve(-residual)
            change, _ = gmres(LinearOperator((len(y),) * 2, matvec=times, dtype=float), start, rtol=1e-5, restart=40)
            y = y + change
        dU.append(float(row @ (y - still)))
    left = np.array(dU)
    return np.asarray(dt / (left[:-1] / left[1:] - 1))


@pytest.mark.parametrize("keys", [{}, {"solid": {"law": "kelvin-voigt", "eta": 0.3}}])
def test_rates_of_shapes_count_on_surfaces_and_in_viscous_solids_alone(keys: Any) -> None:
    """In a liquid without a memory that is all that rates do."""
    branch, _ = solved(**keys)
    at = branch.solver.linearise()
    rates, still = ShapeRates(at), np.zeros(1)
    y_t = np.where(rates.moving, np.random.default_rng(0).uniform(-1e-3, 1e-3, len(at.y)), 0.0)
    whole = rate_terms(at, y_t, still)
    assert rates.terms(y_t) == pytest.approx(whole, abs=1e-9 * np.abs(whole).max())
    h, h_t = at.steady.state()[0], at.steady.constraints.M @ y_t
    assert rates.means @ y_t == pytest.approx([body.mean(h_t, h) for body in at.steady.bodies], rel=1e-9)
    branch.close()


def test_equal_rigid_spheres_neither_move_nor_remember_in_a_newtonian_liquid() -> None:
    found = point(Ca_e=0)
    assert abs(found.dU) < 1e-9
    assert found.motion.remainder.max() < 1e-9
    assert found.t_relax == 0


def test_nothing_is_added_where_the_distance_stands_still() -> None:
    """At a zero of dU nothing moves: zeros of held distances are zeros of the moving pair."""
    branch, _ = solved(beta=0.2, d=(0.03, 0.12), mesh={"Np": 16})
    zero = branch.zero(0.03, 0.12, 0.06)
    branch.close()
    assert abs(zero.dU) < 0.1 * zero.dU_errors[0]
    assert zero.motion.remainder[0] < 1e-3 * zero.dU_errors[0]
    assert zero.slope_at_rest == pytest.approx(float(zero.slopes[0]), rel=0.05)
    assert zero.slope_at_rest != float(zero.slopes[0])


@pytest.mark.slow
def test_a_zero_that_two_meshes_jump_past_is_that_of_one_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the mesh for each distance the zero is at the distance of the other one."""
    branch, _ = solved(beta=0.2, d=(0.03, 0.12), mesh={"Np": 16})

    def zero(below: float, edge: float, above: float) -> Point:
        def nominal(_: object, gaps: tuple[float]) -> tuple[float]:
            return (below if gaps[0] < edge else above,)

        monkeypatch.setattr("pairsim.solvers.problems.SteadyProblem.nominal", nominal)
        return branch.zero(0.03, 0.12, 0.06)

    own = {zero(d, 1.0, d).d: d for d in (0.05, 0.06)}
    assert len(own) == 2
    between = zero(own[max(own)], sum(own) / 2, own[min(own)])
    branch.close()
    assert min(abs(between.d - d) for d in own) < 0.1 * between.zero_error
    assert abs(between.dU) < 0.1 * between.dU_errors[0]


@pytest.mark.slow
def test_dU_of_a_pair_without_a_slow_manifold_is_known_by_its_sign() -> None:
    """It is between that at held distance and none; runs from .004 and .008 pass d = .02 with .0165 and .0168."""
    found = point(Ca_e=0.15, d=(0.02,), mesh={"Np": 20})
    assert found.t_relax * float(found.held_dUs[0]) / float(found.motion.stretch[0]) > 0.02
    assert 0 < found.dU_errors[0] < found.dU
    assert found.dU == pytest.approx(0.0166, abs=float(found.dU_errors[0]))


@pytest.mark.slow
@pytest.mark.parametrize("keys", [{"De": 1.0, "Ca_e": 0, "d": (0.2,)}, {"De": 0.5, "beta": (0.4, 0.3), "Ca_e": 0}])
def test_dU_does_not_depend_on_the_velocity_of_the_mesh(keys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for part in (1.0, 0.3):
        monkeypatch.setattr("pairsim.fem.algebra.mesh_velocity.TRANSITION", part)
        found.append(point(**keys, mesh={"Np": 14}))
    dU, held = np.array([p.dU for p in found]), np.array([p.held_dUs[0] for p in found])
    assert np.ptp(dU) < 1e-3 * abs(dU[0])
    assert np.ptp(dU) < np.ptp(held) / 10
    assert np.ptp(dU) < 2 * max(p.motion.remainder[0] for p in found)


@pytest.mark.slow
@pytest.mark.parametrize("keys", [{"Ca_e": 0.05, "d": (0.04,)}, {"Ca_e": 0.09, "beta": 0.5, "d": (0.05,)}])
def test_a_disturbance_at_held_distance_decays_within_the_relaxation_time(keys: Any) -> None:
    """Close soft pairs have a mode of their gap that outlasts all others."""
    branch, found = solved(**keys, mesh={"Np": 14})
    measured = decays(branch, found.t_relax / 3, 18)
    branch.close()
    assert measured[-1] == pytest.approx(found.t_relax, rel=0.05)
    assert abs(measured[-1] - found.t_relax) < abs(measured[-6] - found.t_relax)


@pytest.mark.long
def test_the_memory_of_a_polymer_adds_to_that_of_the_shape() -> None:
    """The shape of a sphere in a run comes to rest with the time that both memories have together."""
    alone = {**PAIR, "particles": 1, "De": 0.25, "Ca_e": 0.15}
    times = {"time": {"end": 2.5, "tol": 1e-4}, "output": {"fields": False}}
    run = pairsim.run({**alone, **times}).check().table
    found = pairsim.curve(alone).check().table.iloc[0]
    left = np.log(np.abs(run["D_1"] - run["D_1"].iloc[-1]))
    first, last = (int(np.searchsorted(run["t"], t)) for t in (0.7, 1.3))
    measured = (run["t"][last] - run["t"][first]) / (left[first] - left[last])
    assert found["t_relax"] == pytest.approx(measured, rel=0.1)


def test_rigid_particles_remember_as_long_as_the_polymer() -> None:
    assert point(De=0.5, Ca_e=0, d=(0.3,)).t_relax == 0.5


@pytest.mark.slow
def test_t_relax_does_not_depend_on_the_mesh() -> None:
    """Short waves on the surfaces, which outlast what is seen of a disturbance, are different ones on each mesh."""
    coarse, fine = (point(particles=1, d=None, mesh={"Np": Np}).t_relax for Np in (14, 20))
    assert coarse == pytest.approx(fine, rel=0.03)


def test_t_relax_of_a_mode_in_a_polymer_is_the_slower_of_its_two_times(monkeypatch: pytest.MonkeyPatch) -> None:
    """One mode whose solid has 40 % of its time, tau_0 = .3; two halves of a polymer are as one."""
    monkeypatch.setattr("pairsim.solvers.steady.relaxation.shape_time", lambda _: (0.3, 0.4))
    De, xi, tau_s, tau_l = 0.5, 0.2, 0.12, 0.18
    p, q = De + tau_s + tau_l, (tau_s + xi * tau_l) * De
    half = {"law": "giesekus", "weight": 0.5, "time": 1.0}
    for liquid in ("giesekus", {"law": "modes", "modes": [half, half]}):
        case = parse_case(QUESTIONS["curve"], {**PAIR, "De": De, "xi": xi, "liquid": liquid, "d": (0.1,)}, "test")
        at: Any = SimpleNamespace(parameters=SimpleNamespace(liquid=case.liquid_model))
        assert relaxation_time(at) == pytest.approx((p + np.sqrt(p**2 - 4 * q)) / 2, rel=1e-6)


@pytest.mark.parametrize("results", [[[1.0], [0.0]], [[1.0], [0.02]]])
def test_the_time_of_the_shapes_is_the_mean_late_time_of_what_is_seen(results: list[list[float]]) -> None:
    """Two modes of times .2 and 1, of which a disturbance excites the second by a tenth."""
    vectors, mu, excited = np.array([[1.0, 0.3], [0.2, 1.0]]), np.array([0.2, 1.0]), np.array([1.0, 0.1])
    basis = np.column_stack([vectors @ excited, [0.0, 1.0]])
    H = np.linalg.solve(basis, vectors @ np.diag(mu) @ np.linalg.inv(vectors) @ basis)
    modes = np.array(results).T @ np.linalg.solve(basis, vectors) * excited / mu

    def moment(power: int) -> float:
        return quad(lambda t: t**power * float(np.sum((modes @ np.exp(-t / mu)) ** 2)), 0, 40, limit=200)[0]

    assert _late_time(H, np.array(results)) == pytest.approx(2 / 3 * moment(3) / moment(2), rel=1e-6)


def test_the_time_of_one_mode_is_its_own_and_what_grows_has_none() -> None:
    assert _late_time(np.array([[0.7]]), np.array([[2.0]])) == pytest.approx(0.7)
    assert _late_time(np.array([[-0.7]]), np.array([[2.0]])) == np.inf


@pytest.mark.slow
def test_slopes_of_all_velocities_by_each_distance_of_three_are_their_differences() -> None:
    branch, here = solved(d=((0.1, 0.25),), particles=3, length=6.0, mesh={"Np": 10})
    step, largest = 1e-3, float(np.abs(here.held_slopes).max())
    for gap in (0, 1):
        ends = [branch.at(here.parameters.with_longer_gap(gap, s)).discrete.U for s in (step, -step)]
        assert here.held_slopes[:, gap] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-3 * largest)
    branch.close()


def test_slopes_on_the_slow_manifold_belong_to_the_rates_that_they_cause() -> None:
    rng = np.random.default_rng(1)
    held, by_rates, stretch = (
        rng.normal(size=(4, 3)),
        rng.normal(size=(4, 3)),
        np.eye(3) + 0.1 * rng.normal(size=(3, 3)),
    )
    slopes = SlowMotion(np.zeros(4), np.zeros(3), by_rates, stretch, np.zeros(3)).slopes(held)
    rates = np.linalg.solve(stretch, np.diff(slopes, axis=0))  # the distances between centres change by dU
    assert slopes == pytest.approx(held + by_rates @ rates)


@pytest.mark.parametrize(("keys", "later"), [({}, 0.600), ({"beta": 0.5, "Ca_e": 0.05, "d": (0.15,)}, 0.388)])
def test_a_start_from_rest_falls_behind_as_far_as_in_a_run(keys: dict[str, Any], later: float) -> None:
    """By dU times what a run from rest needs more time for at late times (default mesh, against curves at 0.3%)."""
    found = point(**keys, mesh={"Np": 20})
    assert found.motion.from_rest[0] / REST == pytest.approx(later * found.dU, rel=0.06)

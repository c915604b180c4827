"""The adjoint estimate of the discretisation error: its parts against what they are exact for, and against errors."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import steady_problem
from pairsim.fem.diagnostics import Observation
from pairsim.fem.meshes.six_node_mesh import shape_values
from pairsim.fem.recovery.enriched_nodes import EnrichedNodes, nodes_of
from pairsim.fem.recovery.enriched_residual import EnrichedTests
from pairsim.fem.recovery.patch_recovery import WIDE, PatchRecovery
from pairsim.quantities.kinds import STRESS, VELOCITY
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.arrays import Array
from pairsim.solvers import pressure_drop
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.errors.adjoints import Adjoints
from pairsim.solvers.errors.estimate import ELASTIC, VISCOUS, ErrorEstimate, ErrorEstimator, GoalEstimate
from pairsim.solvers.goals import DP_PLUS, ROUNDING, Functional, Goal, U, dU
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.solution import Solution
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import by_continuation
from pairsim.solvers.steady.scene import SteadySolver

NEWTONIAN = {"beta": 0.4, "De": 0}
CLOSE = NEWTONIAN | {"Ca_e": 0.1, "d": (0.1,)}
APART = NEWTONIAN | {"Ca_e": 0.02, "d": (0.3,)}
RIGID = NEWTONIAN | {"Ca_e": 0, "d": (0.1,)}
SINGLE = {"particles": 1, "beta": 0.4, "De": 1, "Ca_e": 0}


def scene_of(keys: dict[str, object], **mesh: float) -> SteadySolver:
    """The solution of the last place of a case with developed ends."""
    case = parse_case(QUESTIONS["curve"], {"ends": "developed", "length": 5.0, "mesh": mesh, **keys}, "test")
    start = Parameters(case.places[-1], case.solid_models, case.liquid_model)
    return arrived(by_continuation(steady_problem(case, min(case.places[0], default=np.inf)), start))


def solved(keys: dict[str, object], **mesh: float) -> tuple[Observation, ErrorEstimate]:
    """What is read off the solution, and the estimate of its errors."""
    scene = scene_of(keys, **mesh)
    at, observation = scene.linearise(), scene.observe()
    estimate = ErrorEstimator().estimate(at, Adjoints.of(at), observation)
    scene.close()
    return observation, estimate


def estimate_of(change: Array, scatter: Array, of_scatter: float) -> GoalEstimate:
    """An estimate of nothing but these errors of dU and their scatter."""
    none = dict.fromkeys(("spread", "cancelled", "beyond", "ends", "newton"), np.zeros(len(change)))
    parts = {**none, "outside": 0.0, "by_regularisation": np.zeros((2, len(change)))}
    return GoalEstimate(dU, change, change, scatter=scatter, **parts, widening=1.0, of_scatter=of_scatter)


def test_an_estimate_that_vanishes_by_chance_in_one_gap_leaves_a_tenth_of_the_others() -> None:
    found = estimate_of(np.array([1e-6, 0.0]), np.zeros(2), VISCOUS)
    assert found.half_width == pytest.approx([1e-6, 1e-7], rel=1e-5)


@pytest.mark.parametrize("of_scatter", [VISCOUS, ELASTIC])
def test_the_scatter_adds_to_what_a_correction_may_leave(of_scatter: float) -> None:
    """The larger one of the two alone does not hold dU where they are alike and of one sign."""
    found = estimate_of(np.array([3e-6]), np.array([2e-6]), of_scatter)
    assert found.half_width == pytest.approx([3e-6 + of_scatter * 2e-6], rel=1e-5)


@cache
def scene_mesh() -> SteadySolver:
    return scene_of(RIGID, Np=10)


@pytest.mark.parametrize("degree", [2, 3])
def test_a_patch_takes_in_rings_of_cells_until_it_has_enough_nodes(degree: int) -> None:
    mesh = scene_mesh().scene.liquid.six_node_mesh
    fits = PatchRecovery(EnrichedNodes(mesh, degree), WIDE[degree]).fits(odd=False)
    rows = fits.shape[0] // len(mesh.vertices)
    for number in range(0, len(mesh.vertices), 7):
        cells = np.flatnonzero((mesh.cells[:, :3] == mesh.vertices[number]).any(axis=1))
        while len(nodes := np.unique(mesh.cells[cells, : 6 if degree == 3 else 3])) < WIDE[degree]:
            cells = np.flatnonzero(np.isin(mesh.cells[:, :3], mesh.cells[cells, :3]).any(axis=1))
        assert np.array_equal(np.sort(fits[rows * number].indices), nodes)


def test_enriched_residual_holds_the_discrete_one() -> None:
    """Tested with a function of the discrete space it is the residual that Newton's method makes vanish."""
    scene = scene_mesh().scene
    phase, random = scene.liquid, np.random.default_rng(1)
    nodes = phase.six_node_mesh.points
    smooth = np.zeros(phase.size)
    for c in range(2):
        smooth[phase.index("u", np.arange(len(nodes)), c)] = np.sin(nodes @ random.uniform(-2, 2, 2) + c)
    phase.set(smooth)
    enriched = EnrichedTests(phase)
    test = np.cos(nodes @ [1.0, 2.0]) * nodes[:, 1]
    points = nodes_of(3)
    values = np.einsum("qa,ma->mq", shape_values(points), test[phase.six_node_mesh.cells[enriched.cells]])
    expected = phase.residual()[phase.index("u", np.arange(len(nodes)), 0)] @ test
    # The two differ by their quadrature only.
    assert np.einsum("mq,mq->", enriched.assemble()["u"][..., 0], values) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "fine"),
    [
        pytest.param(CLOSE, 6.786399e-3, id="close"),
        pytest.param(APART, 3.960515e-4, id="apart", marks=pytest.mark.slow),
    ],
)
def test_effectivity_of_soft_pairs(keys: dict[str, object], fine: float) -> None:
    """Sign and size of the error of dU, against that of N_p 56, which leaves less than a tenth of it."""
    for Np in (20, 28):
        found, estimate = solved(keys, Np=Np)
        error = fine - found.dU[0]
        assert 0.5 < estimate[dU].correction[0] / error < 1.6
        assert abs(estimate[dU].newton[0]) < 1e-3 * abs(error)


def test_velocity_of_a_squeezed_particle() -> None:
    """Without the term of second order U is 1.25 half-widths off; the reference has N_p 44, equal arcs."""
    found, estimate = solved({"particles": 1, "beta": 0.6, "De": 0, "Ca_e": 0.1}, Np=14, grading=2.0)
    assert abs(found.U[0] + estimate[U].correction[0] - 1.535811) < estimate[U].half_width[0] < 5e-4


def test_rigid_pair() -> None:
    """A linear problem: errors of U and their estimates fall with h alike; dU has none by symmetry.

    The exact values are those of N_p 56 with their corrections.
    """
    exact_U, exact_dp_plus = 1.78181403682, 0.619682308
    errors, estimates = [], []
    for Np in (10, 14, 20, 28):
        found, estimate = solved(RIGID, Np=Np)
        assert estimate[dU].half_width[0] < 2 * ROUNDING
        errors.append([exact_U - found.U[0], exact_dp_plus - found.dp_plus])
        estimates.append([estimate[goal].correction[0] for goal in (U, DP_PLUS)])
    ratios = np.array(estimates) / errors
    assert ratios.min() > 0.7
    assert ratios.max() < 1.5
    orders = [np.polyfit(np.log([10, 14, 20, 28]), np.log(np.abs(values)), 1)[0] for values in (errors, estimates)]
    assert (orders[0] < -3).all()
    assert orders[1] == pytest.approx(orders[0], abs=0.5)


@pytest.mark.slow
def test_flow_rate_of_interpolated_ends() -> None:
    """In a viscoelastic liquid the ends carry a flow rate that is off, of which the residual knows nothing.

    The fine values are those of N_p 28 and cells of .05 with their corrections.
    """
    found, estimate = solved(SINGLE, Np=14, max_size=0.1, rows=0.5)
    assert 0.5 < estimate[U].correction[0] / (1.57851127 - found.U[0]) < 1.6
    # What is read off on the ends is a multiple of that off: it converges with the size of the cells only.
    assert 0.7 < estimate[DP_PLUS].correction[0] / (0.0162570427 - found.dp_plus) < 1.4


def test_pressures_are_read_where_the_flow_is_the_developed_one() -> None:
    """The drop on the ends of a Newtonian liquid depends on cells alone; averages over 1 D_c differ by 1.1e-5."""
    keys = {"particles": 1, "beta": 0.55, "De": 0, "Ca_e": 0, "length": "auto"}
    of_drop = solved(keys, Np=20)[1][DP_PLUS]
    assert abs(of_drop.correction[0] - of_drop.change[0]) < 1e-6


@pytest.mark.slow
def test_the_interval_of_a_pressure_drop_holds_that_in_a_longer_tube() -> None:
    """Perturbations of a power law decay slowly: averages over 1 D_c are off by 1.9 half-widths."""
    keys = {"particles": 1, "beta": 0.352, "De": 0, "Ca_e": 0, "liquid": {"law": "power-law", "n": 0.69}}
    found = {}
    for length in ("auto", 6.5):
        observation, estimate = solved(keys | {"length": length}, Np=40, max_size=0.05, rows=1.0)
        found[length] = estimate.corrected(observation).dp_plus, float(estimate[DP_PLUS].half_width[0])
    (short, half_width), (long, _) = found.values()
    assert abs(short - long) < half_width < 0.01 * long


@pytest.mark.parametrize(
    ("pressures", "with_memory", "without"),
    [
        ((1.75, 1.5, 1.0), 0.25, 0.25),  # each change is half of the one before
        ((3.0, 1.0, 0.5), 2.5, 0.0),
        ((1.0, 1.2, 0.9), 0.5, 0.0),
    ],
)
def test_changes_of_the_pressure_that_do_not_decay_towards_an_end_count_in_a_liquid_with_a_memory(
    pressures: Sequence[float], with_memory: float, without: float
) -> None:
    """From the end inwards; a tube that is too short for the memory disturbs its decay."""
    at = dict(zip((0.0, 0.5, 1.0), pressures, strict=True))
    for remember, outside in ((True, with_memory), (False, without)):
        ends: Any = SimpleNamespace(
            remember=remember, average=lambda _, inwards: SimpleNamespace(value=at[inwards], z=1.0 - inwards)
        )
        assert pressure_drop._beyond(ends, 0.0, 1.0) == pytest.approx(outside)


@pytest.mark.slow
def test_the_interval_of_a_pressure_drop_has_what_the_tube_beyond_the_ends_would_add() -> None:
    """Polymer that a moved sphere has strained lowers the pressure up to seven diameters of the tube behind it."""
    keys = SINGLE | {"velocity": 1.0, "flow": 0.0}
    short, long = (solved(keys | {"length": length}, Np=14, max_size=0.15, rows=0.5) for length in (6.4, 14.4))
    missing = abs(np.subtract(*(estimate.corrected(found).dp_plus for found, estimate in (short, long))))
    assert 0.8 * missing < short[1][DP_PLUS].outside < 1.2 * missing
    assert missing > 20 * long[1][DP_PLUS].outside


def test_parts_of_liquid_and_particles_that_cancel_count() -> None:
    """Far apart, what is estimated in the liquid and inside the spheres is a hundred times dU, and cancels but for 1 %.

    dU is 2.042e-5 by pyoomph on quadrilaterals (scripts/studies/codes), and 2.04e-5 here on N_p 80.
    """
    found, estimate = solved(CLOSE | {"d": (0.02, 0.8), "length": "auto"}, Np=22, max_size=0.2)
    left = 2.042e-5 - estimate.corrected(found).dU[0]
    of_dU = estimate[dU]
    assert abs(of_dU.change[0]) + abs(of_dU.spread[0]) < abs(left) < of_dU.half_width[0] < 10 * abs(left)


@pytest.mark.slow
def test_scatter_of_a_viscosity_where_the_shear_rate_vanishes() -> None:
    """On rings of the particles' surfaces, of whose cells the linear estimate sees nothing.

    dU is -5.055e-6 on N_p 112, -5.050e-6 on N_p 160, and -5.048e-6 on N_p 90 with other cells around them.
    """
    thin = {"beta": 0.233, "De": 0, "Ca_e": 0.0074, "liquid": {"law": "power-law", "n": 0.563}, "d": (0.078,)}
    found, estimate = solved(thin, Np=28, max_size=0.2)
    left = abs(-5.05e-6 - estimate.corrected(found).dU[0])
    assert estimate[dU].regular[0] < left < estimate[dU].half_width[0] < 10 * left


@pytest.mark.slow
def test_newtons_method_goes_on_where_it_has_left_much_of_dU() -> None:
    """After its last step by the fields, in a thinning liquid, that was .4 of the half-width, 9.7e-7 of 2.3e-6."""
    thin = {"beta": 0.35, "De": 0, "Ca_e": 0.02, "liquid": {"law": "power-law", "n": 0.52}, "d": (0.03,)}
    scene = scene_of(thin, Np=14, max_size=0.1, rows=1.0)
    estimate = Branch(scene).at(scene.parameters).estimate[dU]
    assert abs(estimate.newton[0]) < 0.1 * estimate.half_width[0]


@pytest.mark.slow
@pytest.mark.parametrize("ends", ["developed", "periodic"])
def test_ends_of_a_short_tube(ends: str) -> None:
    """The part of the error that is due to the ends, against the change of dU in a tube longer by 4.

    What enters upstream and what is missing downstream cancel in part, by more or less on other cells.
    """
    found = {}
    for length in (3.3, 7.3):
        keys = {"beta": 0.4, "De": 0.5, "Ca_e": 0, "d": (0.5,), "ends": ends, "length": length}
        found[length] = solved(keys, Np=10, max_size=0.1, rows=0.5)
    (short, estimate), (long, later) = found[3.3], found[7.3]
    of_short, of_long = estimate[dU], later[dU]
    change = abs((long.dU + of_long.correction - short.dU - of_short.correction)[0])
    assert 0.5 < of_short.ends[0] / change < 10
    assert of_long.ends[0] < 0.05 * of_short.ends[0]
    assert of_short.half_width[0] > of_short.ends_error[0] > change


@pytest.mark.slow
def test_scatter_of_an_unresolved_stress() -> None:
    """In FENE-P the estimate is below half of the error, since it cancels; the interval holds the error all the same.

    On four meshes of 59,000 to 109,000 unknowns (N_p 48 to 64) dU is 1.068e-3 to 1.076e-3.
    """
    keys = {"beta": 0.4, "De": 0.5, "Ca_e": 0, "liquid": {"law": "fene-p", "L2": 100}, "d": (0.3,), "length": "auto"}
    found, estimate = solved(keys, Np=20, max_size=0.07, rows=0.5)
    error = 1.072e-3 - found.dU[0]
    of_dU = estimate[dU]
    assert abs(of_dU.change[0]) + abs(of_dU.spread[0]) < 0.7 * error
    assert error < of_dU.half_width[0] < 10 * error


@pytest.mark.slow
def test_intervals_widen_where_cells_do_not_resolve_the_stress() -> None:
    """An exponential PTT liquid at De 2; the truth is that of cells of .03 and .025."""
    pair = {"beta": 0.4, "De": 2, "Ca_e": 0, "liquid": {"law": "ptt-exp", "epsilon": 0.25}, "d": (0.2,)}
    found, estimate = solved(pair, Np=14, max_size=0.1, grading=1.0)
    corrected, error = float(estimate.corrected(found).dU[0]), float(estimate[dU].half_width[0])
    assert found.conformation is not None
    assert found.conformation.s_jump > 1.5
    assert error / estimate[dU].widening < abs(corrected - 4.1386e-3) < error


MEAN = Goal(
    "U_mean", VELOCITY, lambda _, o: np.array([o.U.mean()]), parent=U, combination=lambda n: np.full((1, n), 1 / n)
)


def test_a_goal_that_is_declared_has_a_correction_and_a_half_width() -> None:
    """The mean velocity of a pair, of which no other file knows."""
    scene = scene_of(CLOSE, Np=12)
    point, known = Branch(scene, goals=(MEAN,)).at(scene.parameters), scene_of(CLOSE, Np=28)
    found, velocities = point.estimate[MEAN], point.estimate[U]
    assert point.values[MEAN] == pytest.approx([point.observation.U.mean()])
    assert found.correction == pytest.approx([velocities.correction.mean()])
    assert 0 < found.half_width[0] <= (1 + 1e-12) * velocities.half_width.mean()
    off = abs(point.held.U.mean() - known.observe().U.mean())
    assert off < found.half_width[0] < 0.01
    assert off < abs(point.discrete.U.mean() - known.observe().U.mean())


def test_a_goal_with_functionals_of_its_own_is_corrected() -> None:
    """The difference of the pressures of two points on the wall, which is nothing that is observed otherwise."""

    def functional(solution: Solution) -> Functional:
        scene = solution.scene
        mesh, row = scene.liquid.six_node_mesh, np.zeros((1, scene.size))
        ends = [int(np.abs(mesh.points[mesh.vertices] - [z, 0.5]).sum(axis=1).argmin()) for z in (-2.0, 2.0)]
        row[0, scene.liquid.index("p", mesh.vertices[ends])] = 1.0, -1.0
        return Functional(np.asarray((solution.constraints.N.T @ row.T).T))

    drop = Goal("drop", STRESS, lambda solution, _: functional(solution).rows @ solution.y, functional)
    scene = scene_of(CLOSE, Np=12)
    point = Branch(scene, goals=(drop,)).at(scene.parameters)
    discrete, found = drop.linear_value(scene.solution), point.estimate[drop]
    assert found.half_width[0] > abs(found.correction[0]) > 0
    assert point.values[drop] == pytest.approx(discrete + found.correction)

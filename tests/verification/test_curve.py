"""Quasi-steady solutions: exact values, the transient they are the limit of, and derivatives."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from support.scenes import traced

import pairsim
from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import steady_problem
from pairsim.fem.algebra.constraints import PositionUpdate
from pairsim.physics.solids import soft
from pairsim.questions.curve import CurveCase
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.curve import Zero, find_zeros
from pairsim.solvers.curves.point import Point
from pairsim.solvers.curves.sensitivities import ALL
from pairsim.solvers.nonlinear.newton import STEADY
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.bordered import solve_with
from pairsim.solvers.steady.continuation import follow
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import by_continuation, first_scene, try_from_other_mesh
from pairsim.solvers.steady.pseudo_time import relax
from pairsim.solvers.steady.scene import SteadySolver

PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": 5.0, "mesh": {"Np": 12}}


def curve(**keys: Any) -> pd.DataFrame:
    """The table of a curve at d alone, .1 by default: no points are added."""
    return pairsim.curve({**PAIR, "d": [0.1], "tol": 1, **keys}).check().table


def case(**keys: object) -> CurveCase:
    return parse_case(QUESTIONS["curve"], {**PAIR, "d": (0.1,), **keys}, "test")


def branch_of(made: CurveCase, *, sensitivities: Collection[str] = ()) -> Branch:
    places = made.places
    start = Parameters(places[0], made.solid_models, made.liquid_model)
    narrowest = min((d for place in places for d in place), default=np.inf)
    return Branch(arrived(first_scene(steady_problem(made, narrowest), start)), sensitivities)


def points(**keys: object) -> list[Point]:
    """The points of one branch in the order of their distances, which a curve does not keep."""
    made = case(**keys)
    branch = branch_of(made)
    found = [branch.at(replace(branch.solver.parameters, gaps=place)) for place in made.places]
    branch.close()
    return found


@pytest.fixture(scope="module")
def viscoelastic() -> Iterator[Branch]:
    """A soft behind a softer, smaller sphere in a Giesekus liquid."""
    mesh = {"Np": 8, "max_size": 0.12}
    made = branch_of(case(De=0.5, Ca_e=(0.05, 0.1), beta=(0.4, 0.35), mesh=mesh), sensitivities=ALL)
    yield made
    made.close()


@pytest.mark.parametrize(
    ("beta", "d", "slope"), [(0.4, 0.1, 5.475377e-2), (0.4, 0.3, 1.965724e-2), (0.2, 0.1, -9.88438e-4)]
)
def test_nearly_rigid_pairs_have_the_exact_slope(beta: float, d: float, slope: float) -> None:
    found = curve(beta=beta, d=[d], Ca_e=1e-4, mesh={"Np": 40}, length="auto")
    assert found["dU"].item() / 1e-4 == pytest.approx(slope, rel=3e-3)


@pytest.mark.slow
def test_equal_rigid_spheres_in_a_newtonian_liquid_keep_their_distance() -> None:
    """At any distance: meshes exist for some of them only, and are squeezed by up to a fifth."""
    places = [0.4, 0.318, 0.2006, 0.1265, 0.1, 0.0798, 0.0317, 0.02]
    found = curve(Ca_e=0, d=places)
    assert found["wanted"].sum() == len(places)
    assert found["dU"].abs().max() < 1e-9
    assert (found["dU"].abs() <= found["dU_error"]).all()


def test_rounding_has_neither_zeros_nor_bends() -> None:
    branch = branch_of(case(Ca_e=0, d=(0.4,), mesh={"Np": 8}))
    found = traced(branch, [(0.4,), (0.24,), (0.14,), (0.08,)], 2e-3, 20)
    assert len(found) == 4
    assert list(find_zeros(branch, found)) == []
    branch.close()


def test_one_particle_has_a_shape_and_a_velocity() -> None:
    """A soft sphere on the axis lags a rigid one by second order in Ca_e: to first order it only becomes an egg."""
    rigid, little, more = (curve(particles=1, Ca_e=Ca_e, d=None).iloc[0] for Ca_e in (0, 0.02, 0.04))
    assert rigid["U_1"] == pytest.approx(1.79081169, rel=2e-4)
    gains = [point["U_1"] - rigid["U_1"] for point in (little, more)]
    assert gains[1] / gains[0] == pytest.approx(4, rel=0.05)
    assert more["D_1"] / little["D_1"] == pytest.approx(4, rel=0.05)


@pytest.mark.slow
def test_three_particles_with_their_own_gaps() -> None:
    """A third one far upstream hardly changes the pair, which is slower than a lone particle and comes closer to it."""
    three = curve(particles=3, d=[[0.8, 0.1]], Ca_e=0.05).iloc[0]
    pair = curve(Ca_e=0.05).iloc[0]
    alone = curve(particles=1, d=None, Ca_e=0.05).iloc[0]
    assert three[["d_1", "d_2"]].tolist() == [0.8, 0.1]
    assert three["dU_2"] == pytest.approx(pair["dU"], rel=0.02)
    assert three["dU_1"] == pytest.approx(pair["U_T"] - alone["U_1"], rel=0.05)


def test_the_matrix_is_the_derivative_of_the_residual(viscoelastic: Branch) -> None:
    scene = viscoelastic.solver
    y = scene.linearise().y
    direction = np.random.default_rng(3).standard_normal(y.size) * np.maximum(np.abs(y), 1e-3)
    update = PositionUpdate(scene.h_star(scene.parameters))
    product = scene.newton.jacobian_times(y, update, direction)
    errors = []
    for e in (1e-4, 5e-5):
        more, less = (scene.newton.residual_at(y + sign * e * direction, update) for sign in (1, -1))
        difference = (more - less) / (2 * e)
        errors.append(np.linalg.norm(difference - product) / np.linalg.norm(product))
    assert errors[1] < 1e-5
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.2)
    scene.recall(scene.snapshot)


@pytest.mark.slow
def test_sensitivities_are_differences_of_neighbouring_solutions(viscoelastic: Branch) -> None:
    """Of pairs that move: held distances alone would be off by 2 % here."""
    here = viscoelastic.solver.parameters
    exact = viscoelastic.at(here).sensitivities
    e, xi = 1e-2, float(here.liquid.xi)
    softer = [here.softer(1 + s * e) for s in (1, -1)]
    faster = [here.with_De(here.De * (1 + s * e)) for s in (1, -1)]
    larger = [here.resized([1 + s * e] * 2) for s in (1, -1)]
    unequal = [here.resized([1 - s * e / 2, 1 + s * e / 2]) for s in (1, -1)]
    thicker = [replace(here, liquid=replace(here.liquid, xi=xi * (1 + s * e))) for s in (1, -1)]
    lines = [("Ca_e", softer, 0.1), ("De", faster, 0.5), ("beta", larger, 0.4), ("xi", thicker, xi)]
    lines += [("difference", unequal, 1.0)]
    for name, places, value in lines:
        high, low = (_moving(viscoelastic, place) for place in places)
        assert exact[name][0] == pytest.approx((high - low) / (2 * e * value), rel=2e-3), name
    _solved(viscoelastic, here)


@pytest.mark.slow
def test_sensitivity_to_beta_holds_where_dU_is_small_on_the_first_mesh() -> None:
    """At d = .4 dU is 3e-4, and its derivative the difference of two that are a hundred times larger."""
    keys = {"d": [0.4], "De": 0, "Ca_e": 0.034, "mesh": {"Np": 18}}
    found = pairsim.curve({**PAIR, "tol": 1, **keys}, sensitivities=True).check().table["by_beta"].item()
    low, high = (curve(**keys, beta=beta)["dU"].item() for beta in (0.396, 0.404))
    assert found == pytest.approx((high - low) / 0.008, rel=0.1), "a tolerance of 1e-4 had made it 2.6 times as large"


@pytest.mark.slow
def test_sensitivity_to_beta_is_the_difference_of_other_spheres() -> None:
    """On meshes of their own: nothing here knows that a diameter can be multiplied."""
    found = pairsim.curve(case(mesh={"Np": 20}), sensitivities=True).check().table["by_beta"].item()
    low, high = (curve(beta=beta, mesh={"Np": 20})["dU"].item() for beta in (0.396, 0.404))
    assert found == pytest.approx((high - low) / 0.008, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("De", "Ca_e"), [(0, 0), (0, 0.1), (0.5, 0.05)])
def test_sensitivity_to_the_difference_of_diameters_is_that_of_unequal_pairs(De: float, Ca_e: float) -> None:
    """The leading particle is larger by .4 % or smaller by as much, on meshes of their own."""
    keys = {"De": De, "Ca_e": Ca_e, "mesh": {"Np": 14}}
    found = pairsim.curve(case(**keys), sensitivities=True).check().table["by_difference"].item()
    pairs = ([0.4 * (1 - s * 0.002), 0.4 * (1 + s * 0.002)] for s in (-1, 1))
    low, high = (curve(beta=betas, **keys)["dU"].item() for betas in pairs)
    assert found == pytest.approx((high - low) / 0.008, rel=0.01)


def _solved(branch: Branch, place: Parameters) -> float:
    assert branch.solver.solve(place).converged
    return float(branch.solver.velocity_row() @ branch.solver.y)


def _moving(branch: Branch, place: Parameters) -> float:
    """dU on the slow manifold, on the mesh at hand, without the estimate of its error."""
    assert branch.solver.solve(place).converged
    found = branch._read(0)
    return float((found.dUs - found.correction)[0])


def test_slopes_are_differences_along_the_curve(viscoelastic: Branch) -> None:
    here = viscoelastic.solver.parameters
    point = viscoelastic.at(here)
    high, low = (_solved(viscoelastic, here.with_gap(0.1 * (1 + e))) for e in (1e-3, -1e-3))
    assert point.slopes[0] == pytest.approx((high - low) / 2e-4, rel=1e-3)
    _solved(viscoelastic, here)


@pytest.mark.slow
def test_a_new_mesh_on_the_way_changes_little(viscoelastic: Branch) -> None:
    """A step that asks for a new mesh is solved on it; going back finds the old solution."""
    scene = viscoelastic.solver
    before, held, meshes = scene.snapshot, viscoelastic.at(scene.parameters).discrete.dU, scene.meshes
    value = float(held[0])
    assert follow(scene, scene.parameters.with_gap(0.2)) is None
    assert scene.meshes > meshes
    assert follow(scene, before.parameters) is None
    back = float(scene.velocity_row() @ scene.y)
    assert back == pytest.approx(value, abs=0.02 * abs(value))
    scene.recall(before)
    assert _solved(viscoelastic, before.parameters) == pytest.approx(value, rel=1e-9)


@pytest.mark.slow
def test_the_first_solution_does_not_depend_on_the_way_to_it() -> None:
    """It comes from that of larger cells in a few iterations, and is the one that many small steps lead to."""
    keys = {"De": 0.5, "Ca_e": (0.05, 0.1), "beta": (0.4, 0.35), "length": 3.0}
    made, larger = (case(**keys, mesh={"Np": Np, "max_size": 0.08}) for Np in (12, 10))
    start = Parameters((0.1,), made.solid_models, made.liquid_model)
    problem = replace(steady_problem(made, 0.1), newton=replace(STEADY, tolerance=1e-11))
    scout = arrived(by_continuation(steady_problem(larger, 0.1), start))
    short, long = SteadySolver(problem, start), arrived(by_continuation(problem, start))
    assert try_from_other_mesh(short, start, scout)
    assert short.factorisations <= 3 < long.factorisations
    for name, unknowns in short.constraints.fields.items():
        assert short.y[unknowns] == pytest.approx(long.y[unknowns], abs=1e-6 if name.startswith("p") else 1e-8)


def test_a_first_solution_is_found_between_narrow_gaps() -> None:
    """Undeformed spheres that nearly fill the tube are no guess for soft ones, but they are for stiff ones."""
    softer, stiffer = (curve(beta=0.7, d=[0.02], Ca_e=Ca_e, mesh={"Np": 10})["dU"].item() for Ca_e in (0.01, 0.001))
    assert softer / 0.01 == pytest.approx(stiffer / 0.001, rel=0.3)


@pytest.mark.slow
def test_values_do_not_depend_on_the_way_to_a_place() -> None:
    """Every distance has a mesh of its own, unless shapes ask for one around themselves."""
    (first, _, _), (_, _, last) = points(d=(0.3, 0.12, 0.9), Ca_e=0.02), points(d=(0.12, 0.9, 0.3), Ca_e=0.02)
    assert last.dU == pytest.approx(first.dU, rel=1e-7)


def accuracy_error(accuracy: str) -> float:
    """Largest error of dU at two held distances, as a part of its peak, against N_p 80 with cells of .1."""
    fine = np.array([6.84027e-5, -9.65350e-5])
    keys = {"mesh": {}, "length": "auto", "d": [0.02, 0.2], "max_points": 2}
    found = curve(beta=0.2, accuracy=accuracy, **keys)["dU_held"].to_numpy()
    return float(np.abs(found - fine).max() / np.abs(fine).max())


@pytest.mark.slow
def test_an_accuracy_is_kept() -> None:
    """With the settings that `accuracy` stands for, dU is as near as it says to a finer mesh's."""
    default = accuracy_error("1%")
    assert default < 0.01
    assert default < accuracy_error("5%") < 0.05


@pytest.mark.long
def test_the_finest_accuracy_is_kept() -> None:
    assert accuracy_error("0.1%") < 1e-3


def test_pseudo_time_reaches_the_steady_solution(viscoelastic: Branch) -> None:
    scene = viscoelastic.solver
    before = scene.snapshot
    faster = before.parameters.with_De(0.55)
    assert scene.solve(faster).converged
    direct = float(scene.velocity_row() @ scene.y)
    scene.recall(before)
    assert relax(scene, faster).converged
    assert float(scene.velocity_row() @ scene.y) == pytest.approx(direct, rel=1e-7)
    scene.recall(before)


def test_a_steady_solution_does_not_change_in_pseudo_time(viscoelastic: Branch) -> None:
    scene = viscoelastic.solver
    liquid, left = scene.scene.liquid, scene.residual_at(scene.parameters, scene.y)
    liquid.set_star(scene.state()[1][: liquid.size])
    liquid.constants["rate"].value = 10.0
    update = PositionUpdate(scene.h_star(scene.parameters))
    assert scene.newton.residual_at(scene.y, update) == pytest.approx(left, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("Ca_e", "d"), [(0.02, 0.0474), (0.1, 0.0554)])
def test_small_spheres_have_a_stable_distance(Ca_e: float, d: float) -> None:
    """Closer they separate, farther apart they attract; distances: N_p 40, docs/explanation/decisions.md."""
    branch = branch_of(case(beta=0.2, Ca_e=Ca_e, length=3.0, d=(0.15, 0.03), mesh={"Np": 16}))
    found = traced(branch, [(0.15,), (0.06,), (0.03,)], 0.02, 20)
    (zero,) = find_zeros(branch, found)
    branch.close()
    assert isinstance(zero, Zero)
    assert abs(zero.point.dU) < zero.point.dU_errors[0]
    assert zero.d == pytest.approx(d, rel=0.03)
    assert zero.point.slopes[0] < 0
    assert found[0].dU > 0 > found[-1].dU


def test_the_distance_of_a_given_dU_is_found_by_a_few_iterations_of_newtons_method() -> None:
    """The distance is an unknown, and dU one of the equations; the iterations converge quadratically."""
    branch = branch_of(case(d=(0.3,)))
    branch.at(branch.solver.parameters)
    steady = branch.solver

    def along(d: float) -> Parameters:
        return replace(steady.parameters, gaps=(d,))

    row, y = steady.velocity_row(), steady.y.copy()
    wanted = 0.9 * float(row @ y)
    before = steady.iterations
    d = solve_with(steady, along, 0.3, y, row, wanted)
    iterations = steady.iterations - before
    assert d is not None
    assert d > 0.3
    again = branch.at(along(d)).discrete.dU
    branch.close()
    assert again == pytest.approx([wanted], rel=1e-6)
    assert iterations <= 4


def test_the_mesh_of_a_solution_is_that_of_its_extension_alone(viscoelastic: Branch) -> None:
    """Assembled in numpy, and from the form in UFL."""
    scene = viscoelastic.solver
    eta = scene.linearise().y[scene.constraints.fields["eta"]]
    assert np.abs(eta).max() > 1e-3
    assert scene.meshed.extend(scene.state()[0])[0] == pytest.approx(eta, abs=1e-12)


@pytest.mark.slow
def test_the_softest_shapes_end_and_the_message_has_the_place() -> None:
    """Two spheres of beta .4 at d .1 have no steady shape beyond a Ca_e near .16, which depends on the mesh."""
    branch = branch_of(case())
    end = follow(branch.solver, branch.solver.parameters.with_Ca_e(0.25))
    branch.close()
    assert end is not None
    assert end.proven
    Ca_e, error = end.on_mesh["Ca_e"]
    assert 0.145 < Ca_e < 0.18
    assert error < 0.1 * Ca_e


def test_a_matrix_that_cannot_be_factored_ends_the_branch() -> None:
    branch = branch_of(case())
    branch.solver.y = np.full_like(branch.solver.y, np.nan)
    with pytest.raises(NoSteadyState, match="singular"):
        branch.solver.linearise()
    branch.close()


def test_an_estimate_that_is_no_number_ends_the_branch_and_no_decay_is_an_empty_column(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("pairsim.solvers.curves.branch.relaxation_time", lambda _: np.inf)
    assert np.isnan(curve(particles=1, d=None)["t_relax"].item())
    monkeypatch.setattr("pairsim.solvers.errors.estimate._flow_rate_defect", lambda _, residual: residual * np.nan)
    result = pairsim.curve({**PAIR, "d": [0.1], "tol": 1})
    assert (result.status, result.reason) == ("failed", "not_resolved")
    assert "the estimate of the error is no number at Ca_e = 0.1, d = 0.1" in result.message


def test_a_problem_remembers_its_narrowest_distance() -> None:
    """Outlines are cut for the narrowest distance of a curve, not for the first one."""
    made = case(d=(0.3,))
    wide, narrow = steady_problem(made, 0.3), steady_problem(made, 0.01)
    arcs = []
    for problem in (wide, narrow):
        branch = Branch(arrived(first_scene(problem, Parameters((0.3,), soft(0.0, 0.0)))))
        arcs.append(len(branch.solver.meshed.outlines[0].angles))
        branch.close()
    assert arcs[1] > arcs[0]


@pytest.mark.slow
def test_dU_does_not_depend_on_where_the_cells_of_a_long_tube_happen_to_lie() -> None:
    """Rows of cells have the same error of the tube's own stress everywhere, which acts on no particle."""
    keys = {"De": 1, "Ca_e": 0, "ends": "developed", "d": [0.4]}

    def spread(rows: float) -> float:
        mesh = {"Np": 8, "max_size": 0.12, "rows": rows}
        found = [curve(**keys, length=length, mesh=mesh)["dU"].item() for length in (5.2, 5.28, 5.37)]
        return float(np.ptp(found))

    assert spread(0.5) < 0.3 * spread(0.0)

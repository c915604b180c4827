"""Where steady shapes end: folds, wrinkles, and the softest particles that have one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import pairsim
from pairsim.computing.along import WRINKLED
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.fem.surface import UNSTABLE, compression, roughness
from pairsim.physics.softest import LARGEST, beyond_steady_shapes, largest_Ca_e
from pairsim.physics.solids import soft
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady import ends, first_solution
from pairsim.solvers.steady.continuation import MESH_SPREAD, SPREAD_OF_SEVERAL, ended
from pairsim.solvers.steady.ends import Ended, end_after
from pairsim.solvers.steady.first_solution import agreed, scene_past_end


def test_compression_of_a_stretched_sphere_is_that_of_its_equator_and_its_poles() -> None:
    """A homogeneous stretch l along the axis: l_m^2 l_h is l^2 l^-1/2 at the equator and l^-3/2 at the poles."""
    angle, stretch = np.linspace(0, np.pi, 401), 0.8
    sphere = np.column_stack([np.cos(angle), np.sin(angle)])
    body: Any = SimpleNamespace(
        outline=SimpleNamespace(nodes=sphere), outline_points=lambda _: sphere * [stretch, stretch**-0.5]
    )
    found = compression(body, np.empty(0))
    assert found[200] == pytest.approx(stretch**1.5, rel=1e-3)
    assert found[[0, -1]] == pytest.approx(stretch**-1.5, rel=1e-3)


def test_waves_as_long_as_cells_make_a_surface_rough() -> None:
    angle = np.linspace(0, np.pi, 61)
    sphere = np.column_stack([np.cos(angle), np.sin(angle)])
    waves = np.column_stack([np.cos(angle + 0.01 * (-1.0) ** np.arange(61)), np.sin(angle)])
    smooth, wrinkled = (
        roughness(SimpleNamespace(outline=SimpleNamespace(nodes=sphere), outline_points=lambda _, at=at: at), angle)  # type: ignore[misc,arg-type]
        for at in (sphere * [0.7, 1.1], waves)
    )
    assert smooth < 1.1 < WRINKLED < wrinkled


@pytest.mark.slow
def test_cells_end_no_branch_before_its_surface_is_unstable() -> None:
    """Its least compression is 0.35. Without a volume modulus waves as long as cells are neutral at Ca_e 0.239."""
    case = {"particles": 1, "beta": 0.6, "Ca_e": 0.256, "ends": "developed", "length": 5.0, "mesh": {"Np": 20}}
    shape = pairsim.shape(case, liquid={"law": "power-law", "n": 0.6}, along=[0.256]).check().table
    assert shape["deformation_hull"][0] == pytest.approx(0.07136, rel=5e-3)


@pytest.mark.parametrize("down", [True, False])
def test_the_end_of_a_branch_is_told_by_two_meshes(down: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A solution on more cells is one on those of the problem where it leads to one, and disproves the end anyway."""
    target, mesh = Parameters((), soft(0.2)), MeshSettings(Np=28)
    problem: Any = SteadyProblem(betas=(0.6,), length=5.0, periodic=False, mesh=mesh)
    first, second = (ended("fold", {"Ca_e": (Ca_e, 0.001)}, target, MESH_SPREAD) for Ca_e in (0.16, 0.17))
    finer: Any = SimpleNamespace(close=lambda: None)
    answers: list[Any] = [second, finer]
    tried = []

    def scene(problem: SteadyProblem, _: Parameters) -> Any:
        tried.append(problem.mesh.Np)
        return answers[len(tried) - 1]

    monkeypatch.setattr(first_solution, "first_scene", scene)
    monkeypatch.setattr(first_solution, "_from_other_mesh", lambda *_: "on its cells" if down else None)
    both = scene_past_end(problem, target, first)
    assert isinstance(both, Ended)
    assert both.at["Ca_e"] == pytest.approx((0.165, 0.006 + SPREAD_OF_SEVERAL * 0.165))
    assert scene_past_end(problem, target, first) == ("on its cells" if down else finer)
    assert tried == [40, 40]


def test_a_half_space_wrinkles_at_biots_stretch() -> None:
    """In plane strain at 0.544, the root of x^3 + x^2 + 3 x = 1 for x = l^2."""
    assert pytest.approx(1, abs=1e-3) == UNSTABLE**3 + UNSTABLE**2 + 3 * UNSTABLE
    assert pytest.approx(0.5437, abs=1e-4) == UNSTABLE**0.5


@pytest.mark.parametrize("fold", [0.2, 1.7])
def test_a_fold_is_where_the_square_of_the_rate_vanishes(fold: float, monkeypatch: pytest.MonkeyPatch) -> None:
    scene: Any = SimpleNamespace(
        recall=lambda tau: setattr(scene, "tau", tau), linearise=lambda: scene, bodies=(), state=lambda: (None, None)
    )
    monkeypatch.setattr(ends, "shape_time", lambda scene: ((fold - scene.tau) ** -0.5, 0.0))
    places = [fold * part for part in (0.5, 0.8, 0.9, 0.95)]
    end = end_after(scene, [(tau, tau) for tau in places])  # type: ignore[misc]
    assert end is not None
    assert end.kind == "fold"
    assert end.at == pytest.approx(fold)
    assert abs(end.at - fold) <= end.error


def test_shapes_that_decay_as_fast_as_ever_are_not_at_their_end(monkeypatch: pytest.MonkeyPatch) -> None:
    scene: Any = SimpleNamespace(recall=lambda _: 0, linearise=lambda: None, bodies=(), state=lambda: (0, 0))
    monkeypatch.setattr(ends, "shape_time", lambda _: (0.5, 0.0))
    assert end_after(scene, [(tau, tau) for tau in (0.1, 0.2, 0.3)]) is None  # type: ignore[misc]


@pytest.mark.slow
@pytest.mark.parametrize("beta", [0.2, 0.4])
def test_a_curve_beyond_the_softest_shapes_says_where_they_end(beta: float) -> None:
    result = pairsim.curve({"beta": beta, "De": 0, "Ca_e": 0.6, "d": [0.2], "ends": "developed", "length": "auto"})
    assert (result.status, result.reason) == ("finished", "no_steady_state")
    Ca_e, error = result.record["end_of_branch"]["Ca_e"]
    known, part = largest_Ca_e(beta)
    assert abs(Ca_e - known) < error + part * known
    assert result.table.empty


def test_the_softest_shapes_have_a_constant_product_of_size_and_softness_in_wide_tubes() -> None:
    products = [beta * Ca_e for beta, (Ca_e, _) in LARGEST.items() if beta <= 0.5]
    assert max(products) < 1.03 * min(products)
    assert largest_Ca_e(0.05)[0] == pytest.approx(0.15 * LARGEST[0.15][0] / 0.05)
    assert list(beyond_steady_shapes((0.4, 0.4), (0.1, 0.1))) == []
    (said,) = beyond_steady_shapes((0.4, 0.4), (0.3, 0.3))
    assert "Ca_e = 0.3 exceeds 0.16" in said


def test_an_end_proves_nothing_of_parameters_within_its_error() -> None:
    at = {"Ca_e": (0.16, 0.01), "d": (0.1, 0.0)}
    near, beyond = (ended("fold", at, Parameters((0.1,), soft(Ca_e, Ca_e)), 0.0) for Ca_e in (0.165, 0.18))
    assert not near.proven
    assert near.failure.reason == "not_resolved"
    assert beyond.proven
    said = str(beyond.failure)
    assert "steady states end at Ca_e = 0.16 +- 0.01, d = 0.1, in a fold, and do not reach Ca_e = 0.18" in said


def test_one_mesh_proves_less_than_two() -> None:
    target, at = Parameters((0.1,), soft(0.2, 0.2)), {"d": (0.1, 0.0)}
    alone, other = (ended("fold", at | {"Ca_e": (Ca_e, 0.01)}, target, MESH_SPREAD) for Ca_e in (0.16, 0.17))
    assert not agreed([alone], target).proven
    found = agreed([alone, other], target)
    assert found.proven
    assert found.at["Ca_e"] == pytest.approx((0.165, 0.015 + SPREAD_OF_SEVERAL * 0.165))
    assert found.at["d"] == (0.1, 0.0)

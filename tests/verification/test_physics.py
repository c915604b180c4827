"""What docs/explanation/physics.md says of pairs, a statement a test, on small meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import simpson

import pairsim
from pairsim.solvers.nonlinear.factors import ACCURATE

SCENE: dict[str, Any] = {
    "beta": 0.4, "De": 0, "Ca_e": 0, "d": [0.2], "ends": "developed", "length": 4, "mesh": {"Np": 14, "max_size": 0.15},
}  # fmt: skip
EXACT = 1e-8
"""Relative difference of two solutions of the same equations, by the tolerance of Newton's method."""


def point(**keys: Any) -> dict[str, float]:
    """The row of a curve at one distance."""
    return dict(pairsim.curve(SCENE | keys).check().table.iloc[0])


def test_reversibility_each_rigid_sphere_is_as_fast_ahead_as_behind() -> None:
    behind, ahead = point(beta=[0.3, 0.4]), point(beta=[0.4, 0.3])
    assert behind["U_T"] == pytest.approx(ahead["U_L"], rel=1e-5)
    assert behind["U_L"] == pytest.approx(ahead["U_T"], rel=1e-5)


@pytest.mark.slow
def test_reversibility_does_not_hold_for_soft_spheres() -> None:
    behind, ahead = point(Ca_e=[0.1, 0]), point(Ca_e=[0, 0.1])
    assert abs(behind["dU"] + ahead["dU"]) > 5 * (behind["dU_error"] + ahead["dU_error"])


@pytest.mark.slow
def test_translation_the_length_of_tube_on_either_side_does_not_matter() -> None:
    soft = [point(Ca_e=0.1, length=length) for length in (4, 6)]
    assert abs(soft[0]["dU"] - soft[1]["dU"]) < soft[0]["dU_error"] + soft[1]["dU_error"]


def test_a_triplet_of_equal_rigid_spheres_moves_as_its_mirror_image() -> None:
    """The one in the middle falls behind: the first gap closes as fast as the second one opens."""
    found = point(particles=3, d=[[0.2, 0.2]], length=5)
    assert found["U_1"] == pytest.approx(found["U_3"], rel=EXACT)
    assert found["dU_1"] == pytest.approx(-found["dU_2"], rel=1e-6)
    assert found["U_2"] < found["U_1"]


@pytest.mark.slow
def test_the_same_volume_flows_through_every_cross_section() -> None:
    """Of the liquid and the particles together: between, beside and through them it is that of the tube, pi/4."""
    grid = pairsim.curve(SCENE | {"Ca_e": 0.15, "fields": [0.2]}).check().fields(0.2)
    for z in (-1.9, -0.5, -0.3, 0.0, 0.3, 1.0):
        line = grid.sample_over_line((z, 0, 0), (z, 0.5, 0), resolution=400)
        found = line["vtkValidPointMask"] == 1
        r, u_z = line.points[found, 1], line["velocity"][found, 0]
        assert simpson(2 * np.pi * r * u_z, x=r) == pytest.approx(np.pi / 4, rel=2e-3), z


@pytest.mark.slow
def test_soft_particles_keep_their_volume() -> None:
    keys = {name: value for name, value in SCENE.items() if name not in ("d",)}
    series = pairsim.run(keys | {"Ca_e": 0.15, "d0": 0.2, "time": {"end": 0.5}, "output": {"fields": False}}).table
    assert series["D_T"].abs().max() > 0.01, "they are deformed"
    assert series["volume_error"].max() < 1e-6


@pytest.mark.slow
def test_dU_converges_with_the_third_power_of_the_mesh_size() -> None:
    """Of cells that are all halved, the second halving changes dU by at most a seventh of what the first one does."""
    meshes = [{"Np": Np, "max_size": 2 / Np} for Np in (8, 16, 32)]
    dU = [point(Ca_e=0.1, mesh=mesh)["dU_held"] for mesh in meshes]
    assert abs(dU[2] - dU[1]) < abs(dU[1] - dU[0]) / 7


@pytest.mark.slow
def test_dU_of_equal_soft_spheres_is_odd_in_their_softness() -> None:
    """The mirror image of a pair in the reversed flow is the pair with -Ca_e: dU = a Ca_e + b Ca_e^3 + ..."""
    dU = [point(Ca_e=Ca_e)["dU_held"] / Ca_e for Ca_e in (1e-3, 2e-3, 4e-3)]
    assert dU[1] == pytest.approx(dU[0], rel=0.01)
    assert (dU[2] - dU[1]) / (dU[1] - dU[0]) == pytest.approx(4, rel=0.05)


@pytest.mark.slow
def test_elasticity_of_the_liquid_acts_on_rigid_pairs_in_proportion_to_the_polymer() -> None:
    dU = [point(De=0.3, xi=1 - polymer)["dU_held"] / polymer for polymer in (1e-3, 2e-3)]
    assert dU[1] == pytest.approx(dU[0], rel=0.02)


ALIKE: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "power law that does not thin": ({"De": 0, "liquid": {"law": "power-law", "n": 1}}, {"De": 0}),
    "White-Metzner that does not thin": (
        {"liquid": {"law": "white-metzner", "n": 1, "Cu": 1}},
        {"liquid": "oldroyd-b"},
    ),
    "one mode twice": (
        {"liquid": {"law": "modes", "modes": [{"law": "giesekus", "alpha": 0.2, "time": 1, "weight": 1}] * 2}},
        {"liquid": {"law": "giesekus", "alpha": 0.2}},
    ),
}


@pytest.mark.parametrize(
    "name", ["power law that does not thin", *(pytest.param(name, marks=pytest.mark.slow) for name in list(ALIKE)[1:])]
)
def test_laws_become_one_another_at_the_ends_of_their_parameters(name: str) -> None:
    """Those of conformations in homogeneous flows: physics/test_laws.py."""
    a, b = (coarse_point(keys) for keys in ALIKE[name])
    for name in ("dU", "dU_held", "U_L", "D_L", "dp_plus"):
        assert a[name] == pytest.approx(b[name], rel=EXACT, abs=1e-12), name


def coarse_point(keys: dict[str, Any]) -> dict[str, float]:
    """A soft pair on few cells with some keys.

    The last Newton step is as accurate as those before: solved to 1e-4 it leaves up to 4e-12 U_av in dU (measured).
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pairsim.solvers.steady.scene.LAST", ACCURATE)
        return point(**{"De": 0.3, "Ca_e": 0.1, "mesh": {"Np": 8, "max_size": 0.25, "rows": 0.5}} | keys)


@pytest.mark.slow
def test_a_neo_hookean_solid_is_a_mooney_rivlin_solid_without_the_second_invariant() -> None:
    one, other = (point(Ca_e=0.1, solid=solid) for solid in ("neo-hookean", {"law": "mooney-rivlin", "c": 0}))
    assert one["dU"] == pytest.approx(other["dU"], rel=EXACT)


@pytest.mark.slow
def test_a_viscous_solid_has_the_shape_of_an_elastic_one_at_rest_and_takes_longer_to_it() -> None:
    elastic, inviscid, viscous = (
        point(Ca_e=0.1, **({} if eta is None else {"solid": {"law": "kelvin-voigt", "eta": eta}}))
        for eta in (None, 0.0, 10.0)
    )
    for name in ("dU_held", "D_L", "D_T"):
        assert inviscid[name] == pytest.approx(elastic[name], rel=EXACT), name
        assert viscous[name] == pytest.approx(elastic[name], rel=1e-6), name
    assert inviscid["dU"] == pytest.approx(elastic["dU"], rel=1e-3)
    assert inviscid["t_relax"] == pytest.approx(elastic["t_relax"], rel=EXACT)
    assert viscous["t_relax"] > 4 * elastic["t_relax"]
    assert abs(viscous["dU"] - viscous["dU_held"]) > 2 * abs(elastic["dU"] - elastic["dU_held"])


@pytest.mark.slow
def test_shape_and_velocity_depend_on_viscosity_over_modulus_alone() -> None:
    """A case in units: twice the viscosity and twice the modulus are the same beads in the same flow."""
    tube = {"tube": "50 um", "particle": "20 um", "velocity": "10 mm/s", "distance": "10 um"}
    keys = {name: value for name, value in SCENE.items() if name not in ("beta", "Ca_e", "d")}
    rows = [
        pairsim.curve(keys | {"physical": tube | {"viscosity": f"{k} Pa.s", "modulus": f"{5 * k} kPa"}}).table.iloc[0]
        for k in (1, 2)
    ]
    assert rows[0]["dU"] == rows[1]["dU"]


@pytest.mark.slow
def test_a_run_from_rest_ends_on_the_quasi_steady_curve() -> None:
    """Once shapes have relaxed, dU(t) is that of the curve at the same distance, and not that at held distance."""
    pair = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": 5, "mesh": {"Np": 24}}
    run = pairsim.run(pair | {"d0": 0.1, "time": {"end": 3.5}, "output": {"fields": False}}).check()
    d, moving = run.table[["d", "dU"]].iloc[-1]
    curve = point(**pair, d=[float(d)])
    moving += curve["dU_correction"]  # of the run, too
    assert abs(moving - curve["dU"]) < curve["dU_error"]
    assert abs(moving - curve["dU"]) < 0.1 * abs(curve["dU"] - curve["dU_held"])


@pytest.mark.slow
def test_held_and_moving_pairs_have_the_same_signs_and_zeros() -> None:
    found = pairsim.curve(SCENE | {"beta": 0.2, "Ca_e": 0.1, "d": [0.03, 0.05, 0.06, 0.2], "tol": 1})
    moving, held = found.table["dU"], found.table["dU_held"]
    assert set(np.sign(moving)) == {1, -1}
    assert (np.sign(moving) == np.sign(held)).all()


@pytest.mark.slow
def test_a_larger_particle_is_slower_and_takes_more_pressure() -> None:
    rows = [point(beta=beta) for beta in (0.2, 0.35, 0.5)]
    assert (np.diff([row["U_L"] for row in rows]) < 0).all()
    assert (np.diff([row["dp_plus"] for row in rows]) > 0).all()

"""The atlas: an interpolant of master curves with intervals."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.atlases import BOX, CASE, D, curves_at, make_atlas, values_at
from support.commands import Pairsim

import pairsim as api
from pairsim.atlas import atlas as shipped
from pairsim.atlas import fit
from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.atlas.kriging import covariance
from pairsim.cases.yaml_file import read_yaml
from pairsim.results.curve_table import curve_of
from pairsim.results.table_files import read_table
from pairsim.runtime.errors import InputError
from pairsim.sweeps.atlas import curve_folders

LOADED = """import sys
from pathlib import Path
from pairsim.atlas.atlas import Atlas
Atlas.load(Path(sys.argv[1])).table(.4, .5, .05)
print(*sys.modules)"""


@pytest.fixture(scope="module")
def made() -> Atlas:
    return make_atlas()


def test_intervals_hold_a_known_function(made: Atlas) -> None:
    x = np.random.default_rng(2).random((100, 3))
    places = np.array([0.3, 0.0, 0.0]) + x * [0.2, 1.0, 0.1]
    dU, half_width = made.velocities(places)
    values = values_at(places)
    assert (np.abs(dU - values) <= half_width).mean() > 0.93
    assert np.median(half_width / np.abs(values).max(axis=1, keepdims=True)) < 0.01
    assert (made.velocities([[0.4, 0.0, 0.0]])[0] == 0).all()
    table = made.table(0.4, 0.5, 0.05)
    assert table["stretch"] == pytest.approx(1 + 0.05 * np.exp(-D), rel=1e-3)
    assert table["U_L"] - table["U_T"] == pytest.approx(table["dU"])


def test_covariances_of_derivatives_are_their_derivatives() -> None:
    X, Z = np.random.default_rng(4).random((2, 3, 3))
    lengths, e = np.array([0.5, 0.7, 0.9]), 1e-5
    for vanishing in (True, False):
        whole = covariance(X, Z, lengths, vanishing)
        for i, step in enumerate(e * np.eye(3)):
            ends = [covariance(X + s * step, Z, lengths, vanishing)[0] for s in (1, -1)]
            assert whole[1 + i] == pytest.approx((ends[0] - ends[1]) / (2 * e), abs=1e-8)


def test_slopes_are_differences(made: Atlas) -> None:
    place, e = np.array([0.41, 0.4, 0.06]), 1e-5
    table = made.table(*place)
    for name, step in zip(PARAMETERS, np.eye(3) * e, strict=True):
        high, low = (made.table(*(place + s * step))["dU"] for s in (1, -1))
        assert table[f"by_{name}"] == pytest.approx((high - low) / (2 * e), rel=1e-4, abs=1e-9)


def test_curves_left_out_are_those_of_the_others_alone() -> None:
    x = np.random.default_rng(5).random((8, 3))
    curves = curves_at(np.array([0.3, 0.0, 0.0]) + x * [0.2, 1.0, 0.1])
    whole, rest = (fit.Curves(*(each[..., at, :] for each in vars(curves).values())) for at in (range(8), range(1, 8)))
    settings = np.array([1.0, 1.0, 1.0, 1e-2, 1e-2, 1e-2, 1e-2])
    found = fit.interpolant(rest, BOX, settings)(fit.scaled(BOX, curves.places[:1])[0])[0][0, 0]
    value = curves.dU[0] / curves.places[0, 0] ** 4
    assert fit.interpolant(whole, BOX, settings).left_out()[0][0] == pytest.approx(found - value, rel=0.05, abs=1e-5)


def test_further_places_are_far_from_known_ones_and_near_errors() -> None:
    candidates = np.random.default_rng(3).random((200, 3))
    chosen = candidates[fit.farthest(np.empty((0, 3)), np.empty(0), candidates, 8)]
    apart = np.linalg.norm(chosen[:, None] - chosen, axis=2) + np.eye(8)
    assert apart.min() > 0.5
    known = np.array([[0.1, 0.5, 0.5], [0.9, 0.5, 0.5]])
    (wanted,) = candidates[fit.farthest(known, np.array([0.1, 1.0]), candidates, 1)]
    assert wanted[0] > 0.5


def test_a_file_has_all_of_an_atlas(made: Atlas, tmp_path: Path) -> None:
    made.save(tmp_path / "a.npz")
    again = Atlas.load(tmp_path / "a.npz")
    for name, column in made.table(0.35, 0.2, 0.03).items():
        assert again.table(0.35, 0.2, 0.03)[name] == pytest.approx(column, rel=1e-12), name
    assert {name: tuple(ends) for name, ends in again.box.items()} == BOX
    assert again.provenance == {"curves": 24, "case": CASE}


def test_what_is_outside_or_no_atlas_is_refused(made: Atlas, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"beta = 0\.6 is not in 0\.3 to 0\.5"):
        made.table(0.6, 0, 0.1)
    (tmp_path / "a.npz").write_text("no")
    with pytest.raises(InputError, match="must be an atlas"):
        Atlas.load(tmp_path / "a.npz")


def test_an_atlas_is_read_with_numpy_alone(made: Atlas, tmp_path: Path) -> None:
    made.save(tmp_path / "a.npz")
    command = [sys.executable, "-c", LOADED, str(tmp_path / "a.npz")]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert not {"dolfinx", "scipy", "pandas", "pydantic", "xarray"} & set(output.split())


@pytest.mark.slow
def test_curves_are_computed_and_made_into_an_atlas(pairsim: Pairsim, tmp_path: Path) -> None:
    spec = tmp_path / "small.yaml"
    base = "{mesh: {Np: 8}, tol: 0.5}"
    spec.write_text(f"beta: [0.3, 0.4]\nDe: [0, 0]\nCa_e: [0, 0.05]\nd: [0.1, 0.3]\ncurves: 4\nbase: {base}\n")
    done = pairsim("atlas", "small.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    assert "4 of 4 cases finished; 4 curves, each off by " in done.stdout + done.stderr
    atlas = Atlas.load(tmp_path / "out" / "atlas.npz")
    assert atlas.provenance["case"]["mesh"]["Np"] == 8
    for folder in curve_folders(tmp_path / "out"):
        table, case = read_table(folder / "curve.csv"), read_yaml(folder / "case.yaml")
        found = atlas.table(*(float(case[name]) for name in PARAMETERS))
        at = [0, -1]  # the ends of d
        assert (np.abs(found["dU"][at] - table["dU"][at]) <= found["dU_error"][at] + table["dU_error"][at]).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "beta", "De", "Ca_e", "liquid", "widest"),
    [
        ("newtonian", 0.27, 0.0, 0.062, "newtonian", 0.1),
        ("newtonian", 0.46, 0.0, 0.031, "newtonian", 0.1),
        ("equal-pairs", 0.36, 0.85, 0.04, "giesekus", 0.3),
        ("equal-pairs", 0.44, 0.3, 0.07, "giesekus", 0.3),
    ],
)
def test_the_atlases_that_ship_hold_fresh_points(
    name: str, beta: float, De: float, Ca_e: float, liquid: str, widest: float
) -> None:
    """Points that they were neither made of nor judged by."""
    atlas, d = Atlas.load(Path(shipped.__file__).with_name(f"{name}.npz")), [0.1, 0.2, 0.4]
    case = {"beta": beta, "De": De, "Ca_e": Ca_e, "d": d, "ends": "developed", "length": "auto", "liquid": liquid}
    point = api.curve(case, tol=1)
    curve = curve_of(atlas.table(beta, De, Ca_e))
    assert curve is not None
    here = [np.isclose(point.columns["d"], each).argmax() for each in d]
    dU, error = (point.columns[name][here] for name in ("dU", "dU_error"))
    assert (np.abs(curve.values(np.array(d)) - dU) <= curve.half_widths(np.array(d)) + error).all()
    assert (curve.half_widths(np.array(d)) < widest * np.abs(dU).max()).all()

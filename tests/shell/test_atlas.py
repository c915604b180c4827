"""The atlas: an interpolant of master curves with intervals."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.atlases import BOX, CASE, D, curves_at, make_atlas, random_places, values_at
from typer.testing import CliRunner

import pairsim as api
from pairsim.app.command_line import app
from pairsim.atlas import atlas as shipped
from pairsim.atlas import fit
from pairsim.atlas.atlas import PARAMETERS, SHIPPED, Atlas, Curves
from pairsim.atlas.kriging import Kriging, covariance
from pairsim.lab.atlas_curve import curve_of_atlas
from pairsim.questions.curve import CurveCase
from pairsim.record.table import Table
from pairsim.runtime.errors import InputError
from pairsim.sweeps.atlas_building import joined
from pairsim.sweeps.atlas_curves import curves_in

LOADED = """import sys
from pathlib import Path
from pairsim.atlas.atlas import Atlas
Atlas.load(Path(sys.argv[1])).at(.4, .5, .05)
print(*sys.modules)"""


def table_of(atlas: Atlas, beta: float, De: float, Ca_e: float) -> Table:
    """The columns of a curve of an atlas."""
    return curve_of_atlas(atlas, beta=beta, De=De, Ca_e=Ca_e).table


@pytest.fixture(scope="module")
def made() -> Atlas:
    return make_atlas()


def test_intervals_hold_a_known_function(made: Atlas) -> None:
    places = random_places(100, 2)
    dU, half_width = made.velocities(places)
    values = values_at(places)
    assert (np.abs(dU - values) <= half_width).mean() > 0.93
    assert np.median(half_width / np.abs(values).max(axis=1, keepdims=True)) < 0.01
    assert (made.velocities([[0.4, 0.0, 0.0]])[0] == 0).all()
    table = table_of(made, 0.4, 0.5, 0.05)
    assert table["stretch"] == pytest.approx(1 + 0.05 * np.exp(-D), rel=1e-3)
    assert table["U_L"] - table["U_T"] == pytest.approx(table["dU"])


def test_covariances_of_derivatives_are_their_derivatives() -> None:
    X, Z = np.random.default_rng(4).random((2, 3, 3))
    lengths, e = np.array([0.5, 0.7, 0.9]), 1e-5
    for vanishing in ((1, 2), (0,), ()):
        whole = covariance(X, Z, lengths, vanishing)
        for i, step in enumerate(e * np.eye(3)):
            ends = [covariance(X + s * step, Z, lengths, vanishing)[0] for s in (1, -1)]
            assert whole[1 + i] == pytest.approx((ends[0] - ends[1]) / (2 * e), abs=1e-8)


def test_deviations_between_dense_curves_are_no_rounding() -> None:
    """They are those of the same data in another order, also where the data leave 1e-10 of the variance."""
    X, at = (np.random.default_rng(seed).random((count, 3)) * [1, 0, 1] for seed, count in ((1, 45), (2, 50)))
    data, lengths = np.sin(X @ [1.0, 0.0, 2.0])[None, :, None] * np.ones((4, 1, 1)), np.array([0.75, 50.0, 0.4])
    data[1:] = np.nan
    deviations = [
        Kriging.of(X[order], data[:, order], np.full((4, 45), 2e-5), lengths, (1, 2))(at)[1]
        for order in (np.arange(45), np.arange(45)[::-1])
    ]
    assert (deviations[0] < 1e-3 * np.hypot(*at.T[1:])).mean() > 0.8
    assert deviations[1] == pytest.approx(deviations[0], rel=1e-3)


def test_slopes_are_differences(made: Atlas) -> None:
    place, e = np.array([0.41, 0.4, 0.06]), 1e-5
    table = table_of(made, *place)
    for name, step in zip(PARAMETERS, np.eye(3) * e, strict=True):
        high, low = (made.at(*(place + s * step)).dU for s in (1, -1))
        assert table[f"by_{name}"] == pytest.approx((high - low) / (2 * e), rel=1e-4, abs=1e-9)


def test_curves_left_out_are_those_of_the_others_alone(made: Atlas) -> None:
    rest = Curves(*(each[1:] for each in vars(made.curves).values()))
    alone = replace(made, curves=rest)
    place, peak = made.curves.places[:1], made.curves.peaks[0]
    expected = (alone.velocities(place)[0] - made.curves.dU[:1]) / peak
    assert fit.left_out(made)[0] == pytest.approx(expected[0], rel=0.05, abs=1e-5)


def test_half_widths_follow_from_curves_at_random_places(made: Atlas) -> None:
    curves = curves_at(np.concatenate([made.curves.places, random_places(6, 6)]))
    curves.dU[-6:] *= 1.1
    of_all = fit.widths_of(curves, made.box, made.settings)
    curves.random[-6:] = False
    assert (fit.widths_of(curves, made.box, made.settings) < 0.9 * of_all).all()


def test_further_places_are_where_intervals_are_wide(made: Atlas) -> None:
    candidates = random_places(200, 3)
    chosen = fit.least_sure(made, candidates, 4)
    assert len(np.unique(chosen, axis=0)) == 4

    def largest(further: np.ndarray) -> float:
        dU, half_width = replace(made, curves=made.curves + curves_at(further)).velocities(candidates)
        return float((half_width.mean(axis=1) / np.abs(dU).max(axis=1)).max())

    assert largest(chosen) < 0.9 * largest(candidates[:4])


def test_a_file_has_all_of_an_atlas(made: Atlas, tmp_path: Path) -> None:
    made.save(tmp_path / "a.npz")
    again = Atlas.load(tmp_path / "a.npz")
    for name, column in table_of(made, 0.35, 0.2, 0.03).items():
        assert table_of(again, 0.35, 0.2, 0.03)[name] == pytest.approx(column, rel=1e-12), name
    assert (again.box, again.provenance) == (BOX, {"case": CASE})


def test_what_is_outside_or_no_atlas_is_refused(made: Atlas, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"beta = 0\.6 is not between 0\.3 and 0\.5"):
        made.at(0.6, 0, 0.1)
    (tmp_path / "a.npz").write_text("no")
    with pytest.raises(InputError, match="must be an atlas"):
        Atlas.load(tmp_path / "a.npz")


def newtonian_case(place: np.ndarray) -> CurveCase:
    return CurveCase.model_validate(CASE | dict(zip(PARAMETERS, place[0], strict=True)) | {"d": [0.02, 2.0]})


def test_curves_of_a_newtonian_liquid_are_those_of_all_others_at_De_0(made: Atlas) -> None:
    places = np.array([[0.35, 0.0, 0.06], [0.45, 0.0, 0.1], [0.25, 0.0, 0.1], made.curves.places[0] + 1e-6])
    theirs = {key: value for key, value in CASE.items() if key != "liquid"} | {"De": 0.0}
    box = {**BOX, "beta": [0.2, 0.5], "De": [0.0, 0.0]}
    other = Atlas(box, {"case": theirs}, D, made.settings, made.widths, curves_at(places))
    found = joined(made, other, newtonian_case, "a.yaml")
    assert found.curves.places[len(made.curves.places) :].tolist() == places[:2].tolist()
    assert found.curves.random[-2:].tolist() == [False, False]
    with pytest.raises(
        InputError, match=r"a.yaml: start: must be atlases of the same curves: length is auto, but 20 in the"
    ):
        joined(made, replace(other, provenance={"case": theirs | {"length": 20.0}}), newtonian_case, "a.yaml")
    with pytest.raises(InputError, match="its curves are at other distances"):
        joined(made, replace(other, d=1.1 * D), newtonian_case, "a.yaml")


@pytest.mark.parametrize(
    ("more", "wrong"),
    [
        (
            "within: {beta: [0.2, 0.35]}\nstart: a.npz",
            "within.beta: got [0.2, 0.35]; must be a part of beta: [0.3, 0.4]",
        ),
        ("within: {beta: [0.3, 0.35]}", "within: must be left out without start"),
        ("diameters: [0.9, 1.1]", "moduli: must be given with diameters, such as [1, 1]"),
        ("diameters: [0.9, 1.1]\nmoduli: [0.5, 2]", "diameters: got [0.9, 1.1]; must go with start"),
        ("diameters: [1.1, 1.2]\nmoduli: [0.5, 2]\nstart: a.npz", "diameters: got [1.1, 1.2]; must be the smallest"),
        ("beads: 5", "beads: got 5; must go with diameters and moduli"),
        ("recompute: true\nstart: a.npz", "curves: got 6; must be left out with recompute"),
        ("recompute: true", "start: must be a single atlas with recompute"),
    ],
)
def test_keys_of_an_atlas_file_are_checked_against_each_other(more: str, wrong: str, tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(f"beta: [0.3, 0.4]\nDe: [0, 0]\nCa_e: [0, 0.1]\ncurves: 6\n{more}\n")
    done = CliRunner().invoke(app, ["atlas", str(tmp_path / "a.yaml"), "-o", str(tmp_path / "out")])
    assert wrong in str(done.exception)


def test_half_widths_nearby_are_not_lost_among_much_smaller_ones(made: Atlas) -> None:
    """As where soft pairs nearly touch: a tenth of those of the others are a hundred times as large."""
    curves = replace(made.curves, errors=made.curves.errors.copy())
    curves.errors[::10] *= 100
    ratios = (
        replace(made, curves=curves).velocities(random_places(300, 9))[1] / made.velocities(random_places(300, 9))[1]
    )
    assert ratios.mean() > 4
    here = replace(made, curves=curves).velocities(curves.places[:1])[1] / made.velocities(curves.places[:1])[1]
    assert (here > 50).all()


@pytest.mark.parametrize(
    ("Ca_e", "base", "wrong"),
    [("[0, 0]", "{}", "Ca_e: got [0, 0]; must end above 0, or De"), ("[0, 0.1]", "{particles: 3}", "must be 2")],
)
def test_what_is_no_atlas_is_refused_before_it_is_computed(Ca_e: str, base: str, wrong: str, tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(f"beta: [0.3, 0.4]\nDe: [0, 0]\nCa_e: {Ca_e}\ncurves: 6\nbase: {base}\n")
    done = CliRunner().invoke(app, ["atlas", str(tmp_path / "a.yaml"), "-o", str(tmp_path / "out")])
    assert wrong in str(done.exception)
    assert not (tmp_path / "out").exists()


def test_a_curve_that_has_not_all_distances_says_why(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"message": "steady states end at Ca_e = 0.2"}')
    (tmp_path / "case.yaml").write_text("beta: 0.4\n")
    with pytest.raises(InputError, match=r"steady states end at Ca_e = 0\.2\): choose a smaller box"):
        curves_in([tmp_path], D, np.zeros((0, 3)))


def test_an_atlas_is_read_with_numpy_alone(made: Atlas, tmp_path: Path) -> None:
    made.save(tmp_path / "a.npz")
    command = [sys.executable, "-c", LOADED, str(tmp_path / "a.npz")]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert not {"dolfinx", "scipy", "pandas", "pydantic", "xarray"} & set(output.split())


def test_the_atlases_that_ship_agree_where_both_have_an_answer() -> None:
    newtonian, giesekus = (Atlas.load(path) for path in sorted(SHIPPED, reverse=True))
    places = random_places(400, 8) * [1, 0, 1]
    (one, half), (other, other_half) = newtonian.velocities(places), giesekus.velocities(places)
    assert (np.abs(one - other) <= half + other_half).all(axis=1).mean() > 0.99


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "beta", "De", "Ca_e", "liquid", "widest"),
    [
        ("newtonian", 0.27, 0.0, 0.062, "newtonian", 0.05),
        ("newtonian", 0.46, 0.0, 0.031, "newtonian", 0.05),
        # Twelve seconds each; stored points at random places, which test_studies.py judges, are of this liquid, too.
        pytest.param("equal-pairs", 0.36, 0.85, 0.04, "giesekus", 0.05, marks=pytest.mark.long),
        pytest.param("equal-pairs", 0.44, 0.3, 0.07, "giesekus", 0.05, marks=pytest.mark.long),
    ],
)
def test_the_atlases_that_ship_hold_fresh_points(
    name: str, beta: float, De: float, Ca_e: float, liquid: str, widest: float
) -> None:
    """Points that they were neither made of nor judged by."""
    atlas, d = Atlas.load(Path(shipped.__file__).with_name(f"{name}.npz")), [0.1, 0.2, 0.4]
    case = {"beta": beta, "De": De, "Ca_e": Ca_e, "d": d, "ends": "developed", "length": "auto", "liquid": liquid}
    point = api.curve(case, tol=1)
    curve = curve_of_atlas(atlas, beta=beta, De=De, Ca_e=Ca_e).interpolant()
    assert curve is not None
    here = [np.isclose(point.columns["d"], each).argmax() for each in d]
    dU, error = (point.columns[name][here] for name in ("dU", "dU_error"))
    assert (np.abs(curve.values(np.array(d)) - dU) <= curve.half_widths(np.array(d)) + error).all()
    assert (curve.half_widths(np.array(d)) < widest * np.abs(dU).max()).all()

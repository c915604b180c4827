"""`pairsim shape` and `pairsim pressure`: the steady shape of one particle, and its pressure drop, over Ca_e."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.special import ellipe
from support.commands import Pairsim

import pairsim as api
from pairsim.computing.case_files import read_case
from pairsim.computing.schema import schema_rows
from pairsim.fem.diagnostics import contour
from pairsim.lab.cytometer.look_up_table import read_look_up_table
from pairsim.quantities.text import with_error
from pairsim.questions.registry import QUESTIONS

BEAD = {"particles": 1, "beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto"}
COARSE = {"mesh": {"Np": 16}}


@pytest.mark.slow
def test_shapes_are_those_of_a_curve_and_grow_with_the_square_of_Ca_e() -> None:
    """The first order of the shape is odd, towards the flow, and has no part in Taylor's D."""
    table = api.shape(BEAD, along=[0.02, 0.01, 0.05], **COARSE).check().table
    assert table["Ca_e"].tolist() == [0.01, 0.02, 0.05]
    assert table["D_1"][1] / table["D_1"][0] == pytest.approx(4, rel=0.05)
    assert (table["D_error"] < 0.1 * abs(table["D_1"])).all()
    finer = api.shape(BEAD, along=[0.05], mesh={"Np": 40}).check().table
    for name, error in (("D_1", "D_error"), ("deformation_hull", "deformation_error"), ("dp_plus", "dp_plus_error")):
        assert abs(table[name][2] - finer[name][0]) < table[error][2] < 0.02 * abs(finer[name][0])
        assert finer[error][0] < 0.5 * table[error][2]
    alone = api.curve({**BEAD, "Ca_e": 0.05}, **COARSE).check().table
    for name in ("D_1", "U_1", "dp_plus"):
        assert table[name][2] == pytest.approx(alone[name][0], rel=1e-6)
    fine = api.curve({**BEAD, "Ca_e": 0.05}, mesh={"Np": 40}).check()
    error = table["U_error_1"][2]
    assert abs(table["U_1"][2] - fine.table["U_1"][0]) < error < 1e-4
    assert f"U_1 = {with_error(*fine.table[['U_1', 'U_error_1']].iloc[0])}." in fine.answer


def test_a_stiff_particle_adds_what_a_rigid_one_does_and_a_soft_one_what_its_curve_says() -> None:
    table = api.pressure(BEAD, along=[0.1, 0.002], **COARSE).check().table
    assert table["Ca_e"].tolist() == [0.002, 0.1]
    for Ca_e, found, within in ((0, table["dp_plus"][0], 1e-3), (0.1, table["dp_plus"][1], 1e-6)):
        alone = api.curve({**BEAD, "Ca_e": Ca_e}, **COARSE).check().table
        assert found == pytest.approx(alone["dp_plus"][0], rel=within)
    assert (table["dp_plus_error"] < 0.01 * table["dp_plus"]).all()


@pytest.mark.parametrize("question", ["shape", "pressure", "curve"])
def test_errors_above_accuracy_are_said(question: str) -> None:
    """Of each of the values that are asked for; given cells are not adapted."""
    errors = {"shape": ("D", "deformation", "dp_plus"), "pressure": ("dp_plus",), "curve": ("D", "dp_plus")}
    fine, rough = (getattr(api, question)(BEAD, accuracy=each, **COARSE).check() for each in ("20%", "0.01%"))
    assert not any("was not kept" in warning for warning in fine.warnings)
    assert fine.record["adaptation"]["kept"]
    for name in errors[question]:
        (warning,) = (each for each in rough.warnings if f": {name}_error is up to " in each)
        assert warning.startswith("accuracy: 0.01% was not kept at Ca_e = 0.1: ")
        assert warning.endswith("; leave out mesh.Np")
        assert warning in rough.answer
    assert not rough.record["adaptation"]["kept"]
    if question != "pressure":
        column = "D_error" if question == "shape" else "D_error_1"
        part = 100 * rough.table[column][0] / abs(rough.table["D_1"][0])
        (warning,) = (each for each in rough.warnings if ": D_error is up to " in each)
        assert float(warning.split()[13]) == pytest.approx(part, rel=0.05)
        assert "% of |D| (0.0" in warning


@pytest.mark.slow
def test_shapes_keep_their_accuracy() -> None:
    """Cells become smaller for D, the deformation and the pressure drop, not for dU alone."""
    result = api.shape(BEAD, along=[0.05, 0.1], accuracy="0.3%").check()
    record, table = result.record["adaptation"], result.table
    assert record["kept"]
    assert not result.warnings
    assert [mesh["Ca_e"] for mesh in record["meshes"]] == [0.05, 0.1]
    assert sum(mesh["rounds"] for mesh in record["meshes"]) >= 1
    for name, value, error in (("D", "D_1", "D_error"), ("dp_plus", "dp_plus", "dp_plus_error")):
        assert record["reached_by"][name] == pytest.approx((table[error] / table[value].abs().max()).max())
        assert record["reached_by"][name] <= 0.003


def test_what_polygons_make_of_a_deformation_is_in_its_half_width() -> None:
    """Of a stiff sphere on fine cells it is most of the error; the true value is that of N_p 20, 40 and 80."""
    table = api.shape(BEAD, beta=0.22, Ca_e=0.01, mesh={"Np": 40}).check().table
    off = table["deformation_hull"][0] - 4.6506e-5
    assert 4e-8 < off < table["deformation_error"][0] < 3 * off


def test_one_softness_is_a_whole_question() -> None:
    for question in (api.shape, api.pressure):
        alone, listed = question(BEAD, **COARSE), question(BEAD, along=[0.1], **COARSE)
        assert alone.table.to_dict() == listed.table.to_dict()
        with pytest.raises(api.InputError, match="Ca_e: got 0; must be above 0: a rigid particle keeps its shape"):
            question(BEAD, Ca_e=0)


@pytest.mark.parametrize("question", ["shape", "pressure"])
def test_a_case_need_not_say_that_there_is_one_particle(question: str) -> None:
    found = getattr(api, question)({"beta": 0.4, "De": 0, "Ca_e": 0.1, "length": 4, "mesh": {"Np": 10}}).check()
    assert found.case.n == 1
    assert len(found.table) == 1
    (row,) = (row for row in schema_rows(QUESTIONS[question].model) if row[0] == "particles")
    assert row[1:3] == ("1", "1"), "what is allowed, and the default"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "said", "columns", "swept"),
    [
        ("shape", "D = (-4.", "Ca_e,D_1,D_error,area [D_c^2],deformation,", "D_1"),
        ("pressure", "The particle adds 0.33", "Ca_e,dp_plus", "dp_plus"),
    ],
)
def test_command_says_draws_reports_and_is_swept(
    command: str, said: str, columns: str, swept: str, tmp_path: Path, pairsim: Pairsim
) -> None:
    (tmp_path / "bead.yaml").write_text(yaml.safe_dump({**BEAD, **COARSE, "along": [0.02, 0.04]}))
    done = pairsim(command, "bead.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    assert said in done.stderr
    assert (tmp_path / "out" / f"{command}.png").is_file()
    assert pairsim("report", "out").returncode == 0
    assert pairsim("table", "out").stdout.startswith(columns)
    question = QUESTIONS[command]
    assert swept in question.in_sweeps.columns(read_case(question, tmp_path / "bead.yaml"))
    assert swept in question.values(tmp_path / "out")


def test_what_a_bead_of_an_experiment_does_is_told_by_its_modulus() -> None:
    bench = {"tube": "50um", "particle": "20um", "flow_rate": "1ul/min", "viscosity": "1Pa.s", "modulus": "5kPa"}
    found = api.pressure({"particles": 1, "physical": bench, "along": [0.02]}, mesh={"Np": 8})
    assert re.search(r"adds [\d.]+ \+- [\d.]+ Pa at Ca_e = 0.02 \(G_p = 8488 Pa\)", found.answer)


def test_a_contour_is_that_of_an_ellipse_and_of_its_hull() -> None:
    a, b = 0.3, 0.2
    angles = np.linspace(0, np.pi, 81)
    seen = contour(np.column_stack([a * np.cos(angles), b * np.sin(angles)]))
    perimeter = 4 * a * ellipe(1 - (b / a) ** 2)
    assert seen.area == pytest.approx(np.pi * a * b, rel=1e-4)
    assert seen.deformation == pytest.approx(1 - 2 * np.pi * np.sqrt(a * b) / perimeter, rel=1e-2)
    assert (seen.area_hull, seen.deformation_hull) == pytest.approx((seen.area, seen.deformation), rel=1e-9)
    assert seen.inertia_ratio_hull == pytest.approx(a / b, rel=1e-4)
    assert seen.volume == pytest.approx(4 / 3 * np.pi * a * b**2, rel=1e-4)


def test_the_hull_closes_the_dent_of_a_rear() -> None:
    angles = np.linspace(0, np.pi, 81)
    dented = np.column_stack([np.maximum(np.cos(angles), -0.5 - 0.3 * np.sin(angles)), np.sin(angles)])
    seen = contour(dented)
    assert seen.area < seen.area_hull
    assert seen.deformation > seen.deformation_hull


@pytest.mark.slow
def test_moduli_are_those_of_a_table_of_cytometry(pairsim: Pairsim, tmp_path: Path) -> None:
    """A sphere in a power-law liquid, against the tables HE-2D-FEM-22 and HE-3D-FEM-22 of dclab at three moduli."""
    case = {
        "command": "shape",
        "base": {
            "physical": {"tube": "21.88um", "flow_rate": "0.04ul/s", "consistency": "0.4057Pa.s^0.6039"},
            "liquid": {"law": "power-law", "n": 0.6039},
            **{"particles": 1, "Ca_e": 0.1, "along": [0.07, 0.1, 0.14], "ends": "developed", "length": "auto"},
            "accuracy": "5%",
        },
        "grid": {"beta": [0.5]},
    }
    (tmp_path / "grid.yaml").write_text(json.dumps(case))
    done = pairsim("sweep", "grid.yaml", "-o", "beads")
    assert done.returncode == 0
    assert "pairsim plot" not in done.stderr, "its pictures are in the folders of its cases"
    assert pairsim("table", "beads", "--cytometry", "-o", "lut.txt").returncode == 0
    assert "--physical: must be left out" in pairsim("table", "beads", "--cytometry", "--physical").stderr
    text = (tmp_path / "lut.txt").read_text()
    meta = json.loads(re.search(r"BEGIN METADATA\n(.*)# END", text, re.DOTALL)[1].replace("#", ""))  # type: ignore[index]
    assert meta["identifier"] == "pairsim:beads"
    assert meta["channel_width"] == pytest.approx(20, rel=1e-3)
    area, deformation, modulus = np.loadtxt(tmp_path / "lut.txt").T
    assert area == pytest.approx([93.92, 93.83, 93.65], rel=1e-3)
    assert deformation == pytest.approx([0.002650, 0.005471, 0.010980], rel=0.015)
    assert modulus == pytest.approx([2.929, 2.050, 1.464], rel=1e-3)
    assert pairsim("table", "beads", "--cytometry", "--channel", "square", "-o", "square.txt").returncode == 0
    modulus, error = read_look_up_table(tmp_path / "square.txt")[1][:, 2:].T
    assert (abs(modulus / [3.161, 2.176, 1.543] - 1) < error).all()
    assert error.max() < 0.06


@pytest.mark.slow
def test_a_large_sphere_in_a_thinning_liquid_is_found() -> None:
    """From a liquid at rest Newton's method fails."""
    case = {"liquid": {"law": "power-law", "n": 0.6}, "beta": 0.7, "Ca_e": 0.05, "particles": 1, "along": [0.02]}
    assert len(api.shape({**case, "ends": "developed", "length": "auto", "mesh": {"Np": 14}}).check().table) == 1


def test_errors_of_force_and_pressure_of_a_moved_particle_are_said() -> None:
    moved = {**BEAD, "Ca_e": 0, "velocity": 1, "flow": 0}
    warnings = api.curve(moved, accuracy="0.01%", **COARSE).check().warnings
    for name in ("F", "dp_plus"):
        assert sum(f": {name}_error is up to " in warning for warning in warnings) == 1, name

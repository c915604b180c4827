"""`pairsim shape`: the steady shape of one particle over Ca_e."""

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
from pairsim.fem.diagnostics import contour

BEAD = {"particles": 1, "beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto"}
COARSE = {"mesh": {"Np": 16}}


def test_shapes_are_those_of_a_curve_and_grow_with_the_square_of_Ca_e() -> None:
    """The first order of the shape is odd, towards the flow, and has no part in Taylor's D."""
    table = api.shape(BEAD, along=[0.02, 0.01, 0.05], **COARSE).check().table
    assert table["Ca_e"].tolist() == [0.01, 0.02, 0.05]
    assert table["D_1"][1] / table["D_1"][0] == pytest.approx(4, rel=0.05)
    assert (table["D_error"] < 0.1 * abs(table["D_1"])).all()
    alone = api.curve({**BEAD, "Ca_e": 0.05}, **COARSE).check().table
    for name in ("D_1", "U_1", "dp_plus"):
        assert table[name][2] == pytest.approx(alone[name][0], rel=1e-6)


@pytest.mark.slow
def test_command_says_draws_and_reports(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "bead.yaml").write_text(yaml.safe_dump({**BEAD, **COARSE, "along": [0.02, 0.04]}))
    done = pairsim("shape", "bead.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    assert "D = (-4." in done.stderr
    assert (tmp_path / "out" / "shape.png").is_file()
    assert pairsim("report", "out").returncode == 0
    assert pairsim("table", "out").stdout.startswith("Ca_e,D_1,D_error,area [D_c^2],deformation,")
    (tmp_path / "grid.yaml").write_text(
        yaml.safe_dump({"command": "shape", "base": {**BEAD, **COARSE, "along": [0.02]}, "grid": {"beta": [0.3]}})
    )
    swept = pairsim("sweep", "grid.yaml", "-o", "swept", "-q")
    assert swept.returncode == 0, swept.stderr
    assert "D_1" in (tmp_path / "swept" / "results.csv").read_text().splitlines()[0]


def test_a_contour_is_that_of_an_ellipse_and_of_its_hull() -> None:
    a, b = 0.3, 0.2
    angles = np.linspace(0, np.pi, 81)
    area, deformation, *hull = contour(np.column_stack([a * np.cos(angles), b * np.sin(angles)]))
    perimeter = 4 * a * ellipe(1 - (b / a) ** 2)
    assert area == pytest.approx(np.pi * a * b, rel=1e-4)
    assert deformation == pytest.approx(1 - 2 * np.pi * np.sqrt(a * b) / perimeter, rel=1e-2)
    assert hull == pytest.approx([area, deformation], rel=1e-9)


def test_the_hull_closes_the_dent_of_a_rear() -> None:
    angles = np.linspace(0, np.pi, 81)
    dented = np.column_stack([np.maximum(np.cos(angles), -0.5 - 0.3 * np.sin(angles)), np.sin(angles)])
    area, deformation, area_hull, deformation_hull = contour(dented)
    assert area < area_hull
    assert deformation > deformation_hull


@pytest.mark.slow
def test_moduli_are_those_of_a_table_of_cytometry(pairsim: Pairsim, tmp_path: Path) -> None:
    """A sphere in a power-law liquid, against the table HE-2D-FEM-22 of dclab (COMSOL) at three moduli."""
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
    assert pairsim("sweep", "grid.yaml", "-o", "beads").returncode == 0
    assert pairsim("table", "beads", "--cytometry", "-o", "lut.txt").returncode == 0
    assert "--tidy: must be left out" in pairsim("table", "beads", "--cytometry", "--tidy").stderr
    text = (tmp_path / "lut.txt").read_text()
    meta = json.loads(re.search(r"BEGIN METADATA\n(.*)# END", text, re.DOTALL)[1].replace("#", ""))  # type: ignore[index]
    assert meta["identifier"] == "beads"
    assert meta["channel_width"] == pytest.approx(20, rel=1e-3)
    area, deformation, modulus = np.loadtxt(tmp_path / "lut.txt").T
    assert area == pytest.approx([93.92, 93.83, 93.65], rel=1e-3)
    assert deformation == pytest.approx([0.002650, 0.005471, 0.010980], rel=0.015)
    assert modulus == pytest.approx([2.929, 2.050, 1.464], rel=1e-3)


def test_a_large_sphere_in_a_thinning_liquid_is_found() -> None:
    """From a liquid at rest Newton's method fails."""
    case = {"liquid": {"law": "power-law", "n": 0.6}, "beta": 0.7, "Ca_e": 0.05, "particles": 1, "along": [0.02]}
    assert len(api.shape({**case, "ends": "developed", "length": "auto", "mesh": {"Np": 14}}).check().table) == 1

"""`pairsim shape`: the steady shape of one particle over Ca_e."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from support.commands import Pairsim

import pairsim

BEAD = {"particles": 1, "beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto"}
COARSE = {"mesh": {"Np": 16}}


def test_shapes_are_those_of_a_curve_and_grow_with_the_square_of_Ca_e() -> None:
    """The first order of the shape is odd, towards the flow, and has no part in Taylor's D."""
    table = pairsim.shape(BEAD, along=[0.02, 0.01, 0.05], **COARSE).check().table
    assert table["Ca_e"].tolist() == [0.01, 0.02, 0.05]
    assert table["D_1"][1] / table["D_1"][0] == pytest.approx(4, rel=0.05)
    assert (table["D_error"] < 0.1 * abs(table["D_1"])).all()
    alone = pairsim.curve({**BEAD, "Ca_e": 0.05}, **COARSE).check().table
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
    assert pairsim("table", "out").stdout.startswith("Ca_e,D_1,D_error,U_1 [U_av],")
    (tmp_path / "grid.yaml").write_text(
        yaml.safe_dump({"command": "shape", "base": {**BEAD, **COARSE, "along": [0.02]}, "grid": {"beta": [0.3]}})
    )
    swept = pairsim("sweep", "grid.yaml", "-o", "swept", "-q")
    assert swept.returncode == 0, swept.stderr
    assert "D_1" in (tmp_path / "swept" / "results.csv").read_text().splitlines()[0]

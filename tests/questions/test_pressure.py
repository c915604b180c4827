"""`pairsim pressure`: the extra pressure drop of one particle over Ca_e."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from support.commands import Pairsim

import pairsim as api

BEAD = {"particles": 1, "beta": 0.4, "De": 0, "ends": "developed", "length": "auto", "mesh": {"Np": 16}}


def test_a_stiff_particle_adds_what_a_rigid_one_does_and_a_soft_one_what_its_curve_says() -> None:
    table = api.pressure({**BEAD, "Ca_e": 0.1}, along=[0.1, 0.002]).check().table
    assert table["Ca_e"].tolist() == [0.002, 0.1]
    for Ca_e, found, within in ((0, table["dp_plus"][0], 1e-3), (0.1, table["dp_plus"][1], 1e-6)):
        alone = api.curve({**BEAD, "Ca_e": Ca_e}).check().table
        assert found == pytest.approx(alone["dp_plus"][0], rel=within)
    assert (table["dp_plus_error"] < 0.01 * table["dp_plus"]).all()


@pytest.mark.slow
def test_its_file_alone_makes_it_a_command_with_picture_and_a_question_of_sweeps(
    tmp_path: Path, pairsim: Pairsim
) -> None:
    (tmp_path / "bead.yaml").write_text(yaml.safe_dump({**BEAD, "Ca_e": 0.1, "along": [0.02, 0.04]}))
    done = pairsim("pressure", "bead.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    assert "The particle adds 0.33" in done.stderr
    assert (tmp_path / "out" / "pressure.png").is_file()
    (tmp_path / "grid.yaml").write_text("{command: pressure, base: bead.yaml, grid: {beta: [0.3]}}")
    assert pairsim("sweep", "grid.yaml", "-o", "swept", "-q").returncode == 0
    assert "dp_plus" in (tmp_path / "swept" / "results.csv").read_text().splitlines()[0]

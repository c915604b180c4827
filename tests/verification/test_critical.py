"""Critical distances against those of finer meshes."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from support.commands import Pairsim


def test_small_soft_spheres_have_a_stable_critical_distance(tmp_path: Path, pairsim: Pairsim) -> None:
    """.0554 at N_p 40 (docs/notebook/quasi-steady.md)."""
    text = "beta: 0.2\nDe: 0\nCa_e: 0.1\nends: developed\nlength: 3\nmesh: {Np: 16}\nmesh_error: false\n"
    (tmp_path / "case.yaml").write_text(text + "along: {Ca_e: [0.1]}\nd: [0.04, 0.08]\n")
    done = pairsim("critical", "case.yaml", "-o", "out", "-q")
    assert done.returncode == 0, done.stderr
    with (tmp_path / "out" / "critical.csv").open() as file:
        (found,) = csv.DictReader(file)
    assert float(found["d_cr"]) == pytest.approx(0.0554, rel=0.03)
    assert found["stable"] == "true"

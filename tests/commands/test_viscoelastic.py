"""Runs in viscoelastic liquids: ranks agree, and an unresolved stress gives a warning."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.commands import Pairsim

from pairsim.results.output import read_series


@pytest.mark.slow
def test_ranks_give_the_same_viscoelastic_series(tmp_path: Path, pairsim: Pairsim) -> None:
    """A rounding difference between processes would grow to order one by t = 0.08."""
    case = (
        "{beta: 0.4, De: 1, Ca_e: [0.1, 0], d0: 0.1, ends: developed, length: 4.9, mesh: {Np: 10}, time: {end: 0.09}}"
    )
    (tmp_path / "case.yaml").write_text(case)
    series = []
    for ranks in (0, 2):
        done = pairsim("run", "case.yaml", "-q", "-o", f"out{ranks}", ranks=ranks)
        assert done.returncode == 0, done.stderr
        series.append(read_series(tmp_path / f"out{ranks}" / "series.csv"))
    for name in series[0]:
        assert series[1][name] == pytest.approx(series[0][name], rel=1e-8, abs=1e-8), name


@pytest.mark.slow
def test_a_stress_that_cells_do_not_resolve_is_told(tmp_path: Path, pairsim: Pairsim) -> None:
    """At the wall of a pipe whose cells are half as large as its radius c changes by more than e^2 within a cell."""
    case = "particles: 0\nDe: 10\nends: developed\nlength: 3\nmesh: {max_size: 0.25}\noutput: {fields: false}\n"
    (tmp_path / "case.yaml").write_text(case)
    for end, count in (("0.001", 0), ("2", 1)):
        done = pairsim("run", "case.yaml", "-o", "out", "--overwrite", "--set", f"time.end={end}")
        assert done.returncode == 0, done.stderr
        assert len(json.loads((tmp_path / "out" / "run.json").read_text())["warnings"]) == count
        assert ("is not resolved" in done.stderr) == bool(count)

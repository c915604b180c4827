"""Runs in viscoelastic liquids: ranks agree, and an unresolved stress gives a warning."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
import yaml
from support.commands import Pairsim

import pairsim

PAIR = {
    "beta": 0.4,
    "De": 1,
    "Ca_e": [0.1, 0],
    "d0": 0.1,
    "ends": "developed",
    "length": 4.9,
    "mesh": {"Np": 8, "max_size": 0.15},
}
PAIR |= {"time": {"end": 0.09}}


@pytest.fixture(scope="module")
def alone() -> pd.DataFrame:
    """The series of one process."""
    return pairsim.run(PAIR).check().table


@pytest.mark.slow
def test_ranks_give_the_same_viscoelastic_series(alone: pd.DataFrame, tmp_path: Path, pairsim: Pairsim) -> None:
    """A difference of one digit between processes, left to itself, would have grown to order one by t = .08."""
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(PAIR))
    done = pairsim("run", "case.yaml", "-q", "-o", "out", ranks=2)
    assert done.returncode == 0, done.stderr
    together = pd.read_csv(tmp_path / "out" / "series.csv")
    assert list(together) == list(alone)
    for name in alone:
        assert together[name].to_numpy() == pytest.approx(alone[name].to_numpy(), rel=1e-8, abs=1e-8), name


@pytest.mark.slow
def test_a_stress_that_cells_do_not_resolve_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    """At the wall of a pipe whose cells are half as large as its radius c changes by more than e^2 within a cell."""
    pipe = {"particles": 0, "De": 10, "ends": "developed", "length": 3, "mesh": {"max_size": 0.25}}
    for end, count in ((0.001, 0), (2, 1)):
        result = pairsim.run(pipe, time={"end": end}, output={"fields": False}, progress=True).check()
        assert len(result.warnings) == count
        assert ("is not resolved" in capfd.readouterr().err) == bool(count)

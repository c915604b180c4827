"""`long_row`: rows of equal particles on their way along a tube."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import pairsim
from pairsim.api.long_rows import LongRow, MovedRow

SOFT = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "length": 6, "mesh": {"Np": 8}}


@pytest.fixture(scope="module")
def pairs() -> LongRow:
    return pairsim.long_row(SOFT, most=2, least=0.1)


def test_a_train_follows_a_row_too(pairs: LongRow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pairsim.solvers.rows.model.models", lambda *_: iter([(1, 1, pairs.model)]))
    case = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d": 0.3, "accuracy": "5%", "mesh": {"Np": 8}, "train": {"cell": 4}}
    row = {"beads": 30, "spread": 0.4, "seed": 3, "tube": 20, "audited": 0}
    train = pairsim.train(case | {"row": row}, folder=tmp_path / "train").check()
    (spread,) = [line for line in train.findings() if line.startswith("Spread of 29 distances within 20 D_c of tube")]
    table = train.frame("row")
    assert table.shape == (101, 30)
    d = table.filter(like="d_").to_numpy()
    spreads = re.findall(r"(?:from|to) ([\d.]+) %", spread)
    known = [100 * each.std() / each.mean() for each in (d[0], d[-1])]
    assert list(map(float, spreads)) == pytest.approx(known, rel=0.01)
    assert table["position"].iloc[-1] == pytest.approx(20.0, rel=0.01)
    assert [path.name for path in pairsim.plot(tmp_path / "train")] == ["train.png", "row.png"]


def test_short_rows_are_those_of_a_curve(pairs: LongRow) -> None:
    curve = pairsim.curve(SOFT | {"d": [0.15, 0.25], "max_points": 2}).check().table
    found = {float(row.gaps[0]): row for row in pairs.equal.solved([(0.25,), (0.15,)])}
    for i, d in enumerate(curve["d"]):
        assert np.diff(found[d].U)[0] == pytest.approx(curve["dU"][i], rel=1e-6)
        assert 1 + found[d].length_slopes[0, 0] == pytest.approx(curve["stretch"][i], rel=1e-9)


def test_distances_at_random_have_mean_spread_and_seed(pairs: LongRow, tmp_path: Path) -> None:
    given = {"mean": 0.6, "spread": 0.3, "seed": 1}
    first, again = (pairs.move(given, 5.0, particles=300).distances for _ in range(2))
    assert first.equals(again)
    (picture,) = pairs.move(given, 5.0, particles=300).plot(tmp_path / "row.png")
    assert picture.stat().st_size > 10_000
    assert first["d_inlet"].mean() == pytest.approx(0.6, rel=0.05)
    assert first["d_inlet"].std() == pytest.approx(0.18, rel=0.1)


def test_what_a_row_says_has_its_error(pairs: LongRow) -> None:
    moved: MovedRow = pairs.move([0.15, 0.2], 40.0, audited=1)
    spread, audit = str(moved).splitlines()
    assert spread.startswith("Spread of 2 distances within 40 D_c of tube: from 14.3 % to ")
    assert audit.startswith("Model against 1 solved rows: dU within ")
    assert moved.audit is not None
    assert 0.01 < moved.audit.dU[0] < 0.6, "sums of pairs are poor"
    before, after = (np.array(moved.distances[name]) for name in ("d_inlet", "d_outlet"))
    assert (after > before).all(), "soft particles separate"


@pytest.mark.parametrize(("d0", "length"), [([0.001], 5.0), ([], 5.0), ([0.2], "5mm")])
def test_what_no_row_can_do_is_refused(pairs: LongRow, d0: list[float], length: float | str) -> None:
    with pytest.raises(pairsim.InputError, match=r"min_gap|physical"):
        pairs.move(d0, length)

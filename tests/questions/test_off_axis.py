"""Rates off the axis beside the answer of a curve, a run or a train, with the key `focus`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import pairsim as api
from pairsim.computing.off_axis.columns import NAME, TABLE
from pairsim.record.table_files import read_table

SOFT = {"beta": 0.4, "De": 0, "Ca_e": 0.05, "mesh": {"Np": 8}, "ends": "developed", "length": 5}
NEEDED = ("pairsim.solvers.focus", "pairsim.fem.azimuthal", "pairsim.computing.off_axis.rows")


def focusing(result: Any) -> Any:
    return read_table(result.folder / f"{NAME}.csv", TABLE)


@pytest.mark.slow
class TestBesideAnswers:
    def test_a_curve_has_the_rates_of_focus_at_its_first_and_last_distance(self, tmp_path: Path) -> None:
        curve = api.curve({**SOFT, "d": [0.1, 0.3], "tol": 1, "focus": True}, folder=tmp_path / "curve").check()
        found = focusing(curve)
        assert [found["d"][0], found["d"][-1]] == pytest.approx([0.1, 0.3])
        alone = api.focus({**SOFT, "particles": 2, "d": 0.3}).check()
        assert found["a_12"][-1] == pytest.approx(alone.table["a_12"][0], abs=2 * alone.table["a_error_12"][0])
        assert found["growth"][-1] == pytest.approx(alone.table["growth"][0], rel=0.02)
        assert any(line.startswith("The pair stays on the axis at d = 0.1 to 0.3") for line in curve.findings())

    def test_a_run_has_them_where_it_begins_and_ends(self, tmp_path: Path) -> None:
        run = api.run({**SOFT, "d0": 0.1, "time": {"end": 0.2}, "focus": True}, folder=tmp_path / "run").check()
        d = focusing(run)["d"]
        assert d[0] == pytest.approx(0.1)
        assert d[-1] == pytest.approx(run.table["d"].iloc[-1])
        assert any("stays on the axis" in line for line in run.answer.splitlines())

    def test_a_bead_alone_has_one_rate(self) -> None:
        curve = api.curve({**SOFT, "particles": 1, "focus": True}).check()
        assert curve.frame(NAME)["growth"].tolist() == pytest.approx([-0.13], rel=0.05)
        assert any(line.startswith("The particle focuses") for line in curve.findings())

    def test_a_train_has_those_of_a_row_of_three_at_its_distance(self, tmp_path: Path) -> None:
        case = {key: value for key, value in SOFT.items() if key not in ("ends", "length")}
        train = api.train({**case, "d": 0.2, "train": {"cell": 4}, "focus": True}, folder=tmp_path / "train").check()
        found = focusing(train)
        assert found["d_1"] == pytest.approx([0.2], rel=1e-3)
        assert found["growth"][0] < 0
        assert any(line.startswith("The row of 3 stays on the axis") for line in train.findings())


@pytest.mark.slow
class TestWithoutIt:
    def test_nothing_of_disturbances_is_computed_written_or_loaded(self, tmp_path: Path) -> None:
        case = {**SOFT, "Ca_e": 0, "d": [0.1]}
        code = (
            f"import sys, pairsim\nr = pairsim.curve({case!r}, folder={str(tmp_path / 'c')!r}).check()\nr.answer\n"
            "r = pairsim.run({'beta': .4, 'De': 0, 'Ca_e': 0, 'd0': .1, 'length': 5, 'mesh': {'Np': 8}, "
            f"'time': {{'end': 1e-3}}}}, folder={str(tmp_path / 'r')!r}).check()\nr.answer\n"
            f"print([name for name in sys.modules if name.startswith({NEEDED!r})])"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == "[]"
        assert not list(tmp_path.rglob("focus.csv"))

    def test_the_key_is_no_part_of_the_case_of_older_versions(self) -> None:
        pair = api.load({**SOFT, "d": [0.1]}, kind="curve")
        from pairsim.cases.identity import identity_of

        assert "focus" not in identity_of(pair)
        assert identity_of(api.load(pair, focus=True))["focus"] is True

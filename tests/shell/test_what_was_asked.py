"""What the first user asked of pairsim, each sentence by name: as typed in a shell, read by other programs.

The shipped cases are in questions/test_run.py and test_curve.py.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import pyvista
from matplotlib import image
from support.commands import Pairsim
from support.inputs import STUDY

from pairsim.results.table_files import read_table

CASE = """
beta: 0.4
De: 0
Ca_e: 0.1
d0: 0.1
ends: developed
length: 3
time: {end: 0.02}
"""
GRID = f"base: {{{', '.join(CASE.split(chr(10))[1:-1])}}}"


@pytest.fixture
def table_of(tmp_path: Path, pairsim: Pairsim) -> Any:
    """The table that a command writes of a file."""

    def compute(command: str, content: str, table: str, **more: Any) -> pd.DataFrame:
        (tmp_path / "file.yaml").write_text(content)
        done = pairsim(command, "file.yaml", "-o", "out", "-q", **more)
        assert done.returncode == 0, done.stderr
        return pd.read_csv(tmp_path / "out" / table, float_precision="round_trip")

    return compute


@pytest.mark.slow
def test_a_yaml_case_of_four_numbers_gives_a_csv_series_of_dU_and_taylor_D_and_xdmf(
    table_of: Any, tmp_path: Path
) -> None:
    series = table_of("run", f"{CASE}\nmesh: {{Np: 8}}", "series.csv")
    assert {"t", "d", "dU", "D_L", "D_T"} <= {*series}
    assert series["t"].iloc[-1] == 0.02
    assert series["dU"].iloc[-1] != 0
    assert abs(series["D_L"].iloc[-1]) > abs(series["D_L"].iloc[0])
    times = pyvista.get_reader(tmp_path / "out" / "fields.xdmf").time_values
    assert times == sorted(times)
    assert times[-1] == 0.02


@pytest.mark.slow
def test_a_sweep_under_mpirun_has_a_row_a_case(table_of: Any) -> None:
    table = table_of("sweep", f"{GRID}\ngrid: {{d0: [0.1, 0.2, 0.3], mesh.Np: [8]}}", "results.csv", ranks=2)
    assert [*table["d0"]] == [0.1, 0.2, 0.3]
    assert [*table["status"]] == ["finished"] * 3
    assert table["dU"].all()


@pytest.mark.slow
def test_a_study_reports_speed_against_error(table_of: Any, tmp_path: Path, pairsim: Pairsim) -> None:
    """It draws them; the same command computes no case again."""
    table = table_of("study", STUDY, "study.csv")
    assert table["mesh.Np"].tolist() == [8, 11, 16, 8]
    assert table["reference"].tolist() == [False, False, True, False]
    assert table["steps"][3] == 4
    assert table["error"][1] < table["error"][0]
    assert (table["wall_time"] > 0).all()
    assert {*table["dU@0.02"]} == {read_table(path)["dU"][-1] for path in tmp_path.glob("out/*/series.csv")}
    assert image.imread(tmp_path / "out" / "study.png").shape[1] > 500
    records = {path: path.read_text() for path in tmp_path.glob("out/*/run.json")}
    assert len(records) == 4
    (tmp_path / "out" / "study.csv").unlink()
    assert pairsim("study", "file.yaml", "-o", "out", "-q").returncode == 0
    assert all(path.read_text() == text for path, text in records.items())
    assert (tmp_path / "out" / "study.csv").is_file()

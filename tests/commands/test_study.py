"""`pairsim study`: a complete study on two ranks."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from matplotlib import image
from support.commands import Pairsim
from support.inputs import STUDY

from pairsim.results.table_files import read_table


@pytest.mark.slow
def test_study_runs_resumes_and_draws(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "study.yaml").write_text(STUDY)
    done = pairsim("study", "study.yaml", "-o", "out", "-q", ranks=2)
    assert (done.returncode, done.stdout.strip()) == (0, "out"), done.stderr
    with (tmp_path / "out" / "study.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["mesh.Np"], row["time.fixed_step"]) for row in rows] == [
        ("8", ""), ("11", ""), ("16", ""), ("8", "0.005"),
    ]  # fmt: skip
    assert [row["reference"] for row in rows] == ["false", "false", "true", "false"]
    assert [row["steps"] for row in rows][3] == "4"
    errors = [float(row["error"]) for row in rows if row["error"]]
    assert len(errors) == 3
    assert 0 < errors[1] < errors[0] < 0.1
    ends = {float(row["dU@0.02"]) for row in rows}
    assert ends == {read_table(path)["dU"][-1] for path in tmp_path.glob("out/sweep-1/*/series.csv")}
    assert image.imread(tmp_path / "out" / "study.png").shape[1] > 500
    records = {path: path.read_text() for path in tmp_path.glob("out/sweep-1/*/run.json")}
    assert len(records) == 4
    (tmp_path / "out" / "study.csv").unlink()
    again = pairsim("study", "study.yaml", "-o", "out", "-q")
    assert again.returncode == 0, again.stderr
    assert all(path.read_text() == text for path, text in records.items())
    assert (tmp_path / "out" / "study.csv").is_file()

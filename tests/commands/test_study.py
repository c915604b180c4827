"""`pairsim study`: a quasi-steady curve against a run in time, and a complete study on two ranks."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from matplotlib import image
from support.commands import Pairsim
from support.inputs import STUDY

from pairsim.results.table_files import read_table


@pytest.mark.slow
def test_quasi_steady_is_compared_with_the_transient(tmp_path: Path, pairsim: Pairsim) -> None:
    text = """
base: {beta: 0.4, De: 0, Ca_e: 0.02, d0: 0.1, ends: developed, length: 3, mesh: {Np: 12}, time: {end: 0.7}, tol: 1}
over: d
at: 0.1005
discretisations: [{command: run, dU_error: true}, {command: curve}, {command: curve, mesh.Np: 8}]
reference: 0
"""
    (tmp_path / "study.yaml").write_text(text)
    done = pairsim("study", "study.yaml", "-o", "out", "-q")
    assert done.returncode == 0, done.stderr
    with (tmp_path / "out" / "study.csv").open() as file:
        run, same, other = csv.DictReader(file)
    assert [row["command"] for row in (run, same, other)] == ["run", "curve", "curve"]
    assert 0 < float(same["relative_error"]) < 0.01, "the quasi-steady view, on one mesh"
    assert float(other["relative_error"]) > float(same["relative_error"])


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
    ends = {float(row["dU"]) for row in rows}
    assert ends == {read_table(path)["dU"][-1] for path in tmp_path.glob("out/sweep-1/*/series.csv")}
    assert all(50e6 < int(row["peak_memory"]) < 4e9 for row in rows)
    assert image.imread(tmp_path / "out" / "study.png").shape[1] > 500
    records = {path: path.read_text() for path in tmp_path.glob("out/sweep-1/*/run.json")}
    assert len(records) == 4
    (tmp_path / "out" / "study.csv").unlink()
    again = pairsim("study", "study.yaml", "-o", "out", "-q")
    assert again.returncode == 0, again.stderr
    assert all(path.read_text() == text for path, text in records.items())
    assert (tmp_path / "out" / "study.csv").is_file()

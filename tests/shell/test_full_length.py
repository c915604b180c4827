"""The shipped cases, not shortened, give the results described in `configs/README.md`."""

from __future__ import annotations

import csv
import json
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.commands import Pairsim
from support.inputs import CONFIGS, ROOT

from pairsim.record.table_files import read_table
from pairsim.runtime.arrays import Array
from pairsim.runtime.child_process import module_command

pytestmark = [pytest.mark.long, pytest.mark.timeout(3600)]

SHOWN: dict[str, Callable[[dict[str, Array]], bool]] = {
    "pulses": lambda series: np.nanmax(series["drift"]) > 0 > series["Q"].min(),
    "quickstart": lambda series: series["dU"].min() < 0 < series["dU"][-1],
    "pipe": lambda series: np.abs(series["dp_plus"]).max() < 1e-9,
    "single_soft": lambda series: abs(series["D_1"][-1] / series["D_1"][-2] - 1) < 1e-3,
    "rigid_pair": lambda series: np.abs(series["dU"]).max() < 1e-9,
    "unequal": lambda series: series["dU"][0] < 0 < series["dU"][-1],
    "triplet": lambda series: series["dU_1"][-1] != pytest.approx(series["dU_2"][-1], rel=0.01),
    "separation": lambda series: (
        series["d"][-2] < 0.6 <= series["d"][-1] and series["t"][-1] == pytest.approx(194, rel=0.01)
    ),
    "viscoelastic": lambda series: series["dU"].max() > 0 > series["dU"][-1],
}


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_shipped_run(path: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    done = pairsim("run", str(path), "-o", "out", "-q")
    assert done.returncode == 0, done.stderr
    assert SHOWN[path.stem](read_table(tmp_path / "out" / "series.csv"))


def test_shipped_curve_has_the_zero_of_the_critical_distances(tmp_path: Path, pairsim: Pairsim) -> None:
    done = pairsim("curve", str(ROOT / "configs" / "curve.yaml"), "-o", "out", "-q")
    assert done.returncode == 0, done.stderr
    one = ["--set", "along={Ca_e: [0.1]}"]
    done = pairsim("critical", str(ROOT / "configs" / "critical.yaml"), "-o", "critical", "-q", *one)
    assert done.returncode == 0, done.stderr
    (critical,), zeros = (rows(tmp_path / name) for name in ("critical/critical.csv", "out/equilibria.csv"))
    d_cr = float(critical["d_cr"])
    curve = min(zeros, key=lambda zero: abs(float(zero["d"]) - d_cr))
    assert float(curve["d"]) == pytest.approx(d_cr, rel=1e-3)
    assert (curve["stable"], critical["stable"]) == ("false", "false")


@pytest.mark.parametrize(
    ("De", "expected"),
    [
        (0.125, {0.005: 0.284, 0.04: 0.1385}),
        (0.25, {0.005: 0.274, 0.15: 0.0804}),
        (0.5, {0.005: 0.2488, 0.15: 0.2292}),
        (1.0, {}),
    ],
)
def test_shipped_critical_distances_are_those_of_the_docs(
    De: float, expected: dict[float, float], tmp_path: Path, pairsim: Pairsim
) -> None:
    """Fig. 11 of the paper: values of finer meshes, which those of the coarse one agree with within their errors."""
    done = pairsim("critical", str(ROOT / "configs" / "critical.yaml"), "-o", "out", "-q", "--set", f"De={De}")
    assert done.returncode == 0, done.stderr
    wanted = {float(row["Ca_e"]): row for row in rows(tmp_path / "out" / "critical.csv") if row["kind"] == "wanted"}
    found = {Ca_e: float(row["d_cr"]) for Ca_e, row in wanted.items()}
    assert {Ca_e: found[Ca_e] for Ca_e in expected} == pytest.approx(expected, rel=0.025)
    for Ca_e, d_cr in expected.items():
        assert abs(found[Ca_e] - d_cr) < float(wanted[Ca_e]["d_error"])
    assert found
    assert De < 1 or all(0.178 < d_cr < 0.192 for d_cr in found.values())


@pytest.mark.parametrize(("command", "count"), [("sweep", 24), ("study", 9)])
def test_shipped_cases_of_many_all_finish(command: str, count: int, tmp_path: Path, pairsim: Pairsim) -> None:
    done = pairsim(command, str(ROOT / "configs" / f"{command}.yaml"), "-o", "out", "-q")
    assert done.returncode == 0, done.stderr
    records = [json.loads(path.read_text()) for path in (tmp_path / "out").rglob("run.json")]
    assert len(records) == count
    assert {record["status"] for record in records} == {"finished"}


def rows(table: Path) -> list[dict[str, str]]:
    with table.open() as file:
        return list(csv.DictReader(file))


STEPS, POINTS = 5000, 3000
MANY_STEPS = "beta: 0.4\nDe: 0\nCa_e: 0\nd0: 0.1\nlength: 3\nends: developed\nmesh: {Np: 6}\n"
MANY_STEPS += f"time: {{end: 100, max_step: 0.002}}\noutput: {{every: 0.02}}\nlimits: {{max_steps: {STEPS}}}\n"
MANY_POINTS = "beta: 0.4\nDe: 0\nCa_e: 0\nlength: 3\nends: developed\nmesh: {Np: 6}\ntol: 1\n"
MANY_POINTS += f"d: {{start: 0.1, stop: 1, num: {POINTS}, spacing: log}}\nmax_points: {POINTS}\n"


def growth(folder: Path, command: str, text: str, table: str, count: int) -> float:
    """Growth of the memory from a fifth of the rows of a table to the last but one [MB].

    After the last row the answer is put into words, with modules of some 8 MB that nothing has needed before.
    """
    (folder / "case.yaml").write_text(text)
    words = module_command("pairsim", command, "case.yaml", "-o", "out", "-q")
    process = subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    first = last = 0.0
    path = folder / "out" / table
    try:
        while process.poll() is None:
            status = Path(f"/proc/{process.pid}/status").read_text()
            rows = path.read_bytes().count(b"\n") - 1 if path.exists() else 0
            # Memory that the system has moved to swap counts as well.
            sizes = [float(line.split()[1]) for line in status.splitlines() if line.startswith(("RssAnon", "VmSwap"))]
            if sizes and count // 5 <= rows < count:
                last = sum(sizes) / 1000
                first = first or last
            time.sleep(0.5)
    finally:
        process.kill()
    assert path.read_bytes().count(b"\n") - 1 == count
    assert first
    print(f"{command}: {first:.1f} MB after {count // 5} rows, {last:.1f} MB after {count}")
    return last - first


def test_memory_of_a_run_does_not_grow(tmp_path: Path) -> None:
    """Frames of the fields are written every tenth step, too."""
    assert growth(tmp_path, "run", MANY_STEPS, "series.csv", STEPS) < 2


def test_memory_of_a_curve_grows_by_the_numbers_of_its_points(tmp_path: Path) -> None:
    """What is kept of a point are its numbers and its row of curve.csv, some thirty Python objects and 4 kB."""
    assert growth(tmp_path, "curve", MANY_POINTS, "curve.csv", POINTS) < 6e-3 * (POINTS - POINTS // 5)

"""The memory of a run does not grow with its steps, that of a curve only by the numbers of its points."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

import pytest

from pairsim.runtime.child_process import module_command

STEPS, POINTS = 5000, 3000
RUN = "beta: 0.4\nDe: 0\nCa_e: 0\nd0: 0.1\nlength: 3\nends: developed\nmesh: {Np: 6}\n"
RUN += f"time: {{end: 100, max_step: 0.002}}\noutput: {{every: 0.02}}\nlimits: {{max_steps: {STEPS}}}\n"
CURVE = "beta: 0.4\nDe: 0\nCa_e: 0\nlength: 3\nends: developed\nmesh: {Np: 6}\ntol: 1\n"
CURVE += f"d: {{start: 0.1, stop: 1, num: {POINTS}, spacing: log}}\nmax_points: {POINTS}\n"


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


@pytest.mark.long
def test_run(tmp_path: Path) -> None:
    """Frames of the fields are written every tenth step, too."""
    assert growth(tmp_path, "run", RUN, "series.csv", STEPS) < 2


@pytest.mark.long
def test_curve(tmp_path: Path) -> None:
    """What is kept of a point are its numbers and its row of curve.csv, some thirty Python objects and 4 kB."""
    assert growth(tmp_path, "curve", CURVE, "curve.csv", POINTS) < 6e-3 * (POINTS - POINTS // 5)

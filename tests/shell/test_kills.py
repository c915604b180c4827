"""SIGKILL at random moments: finished rows and frames are kept, and the next command finishes."""

from __future__ import annotations

import json
import os
import random
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import pytest
from support.commands import Pairsim
from support.frames import frames_everywhere

import pairsim as api
from pairsim.record.table_files import read_table
from pairsim.runtime.child_process import module_command
from pairsim.solvers.nonlinear.newton import TRANSIENT

KILLS = int(os.environ.get("PAIRSIM_KILLS", "20"))
"""Number of kills of a run."""
SEED = 61
PAIR = "beta: 0.4\nDe: 0\nCa_e: 0.1\nlength: 3\nends: developed\nmesh: {Np: 8}\n"
RUN = PAIR + "d0: 0.1\ntime: {end: 0.15, fixed_step: 0.01}\noutput: {checkpoint: 0, every: 0.015}\n"
CURVE = PAIR + "tol: 1\nd: {start: 0.1, stop: 0.4, num: 4}\nfields: [0.1, 0.4]\n"
PATIENCE = 300.0  # seconds
MOST = 4 * TRANSIENT.tolerance * 2
"""What Newton's tolerance leaves of two velocities of at most 2 U_av in two runs whose steps are the same [U_av]."""


def rows_of(path: Path) -> int:
    """Number of rows of a table, 0 without it."""
    with suppress(FileNotFoundError):
        return max(path.read_bytes().count(b"\n") - 1, 0)
    return 0


class Command:
    """A command in a folder that has `in.yaml`."""

    def __init__(self, folder: Path, *words: str) -> None:
        self._errors = folder / "stderr"
        with self._errors.open("wb") as errors:
            self._process = subprocess.Popen(
                module_command("pairsim", *words, "-q"), cwd=folder, stdout=subprocess.DEVNULL, stderr=errors
            )

    def kill(self, table: Path, rows: int, moment: float) -> bool:
        """Kill it some seconds after its table has so many rows; returns whether it was still at work."""
        deadline = time.monotonic() + PATIENCE
        while rows_of(table) < rows and self._process.poll() is None:
            assert time.monotonic() < deadline, self._errors.read_text()
            time.sleep(0.005)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(moment)
        alive = self._process.poll() is None
        self._process.kill()
        self._process.wait()
        assert "Traceback" not in self._errors.read_text()
        return alive


@pytest.mark.slow
@pytest.mark.timeout(300 + 60 * KILLS)
@pytest.mark.parametrize("kills", [2, pytest.param(KILLS, marks=pytest.mark.long)])
def test_a_run_killed_again_and_again_loses_nothing(kills: int, tmp_path: Path, pairsim: Pairsim) -> None:
    """The frames open in pyvista and meshio after each kill, and are in the end those of a run that was not killed."""
    (tmp_path / "in.yaml").write_text(RUN)
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    assert pairsim("run", "in.yaml", "-o", "whole", "-q").returncode == 0
    chance, table = random.Random(SEED), killed / "series.csv"
    met, counts, last = 0, [], rows_of(whole / "series.csv")
    for rows in sorted(chance.choices(range(last), k=kills)):
        words = ("--resume", "killed") if killed.exists() else ("-o", "killed")
        before = rows_of(table)
        met += Command(tmp_path, "run", "in.yaml", *words).kill(table, rows, chance.uniform(0, 0.5))
        counts.append(len(frames_everywhere(killed)))
        assert rows_of(table) >= before - 1, "one step at most has no checkpoint yet, and is computed again"
        assert counts[-1] >= max(counts) - 1
    assert pairsim("run", "in.yaml", "--resume", "killed", "-q").returncode == 0
    print(f"{kills} kills, {met} of a running process; frames after each: {counts}")
    assert met
    assert json.loads((killed / "run.json").read_text())["status"] == "finished"
    frames = [frames_everywhere(folder) for folder in (whole, killed)]
    assert len(frames[0]) == 11
    for one, other in zip(*frames, strict=True):
        assert other.t == pytest.approx(one.t)
        assert other.points == pytest.approx(one.points, abs=MOST), "the same mesh, moved by the same steps"
    one, other = (read_table(folder / "series.csv") for folder in (whole, killed))
    for name in ("d", "dU"):
        assert other[name][-1] == pytest.approx(one[name][-1], rel=0, abs=MOST)


@pytest.mark.slow
def test_a_killed_curve_has_whole_rows_and_frames(tmp_path: Path) -> None:
    (tmp_path / "in.yaml").write_text(CURVE)
    table = tmp_path / "out" / "curve.csv"
    Command(tmp_path, "curve", "in.yaml", "-o", "out").kill(table, 2, 0.1)
    text = table.read_text()
    assert text.endswith("\n")
    assert len({line.count(",") for line in text.splitlines()}) == 1
    assert [frame.t for frame in frames_everywhere(tmp_path / "out")][-1:] == [pytest.approx(0.4)]
    api.curve(tmp_path / "in.yaml", folder=tmp_path / "out", overwrite=True).check()
    assert [frame.t for frame in frames_everywhere(tmp_path / "out")] == pytest.approx([0.1, 0.4])

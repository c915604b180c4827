"""Commands that are killed at random moments, and the outcomes that must not depend on it."""

from __future__ import annotations

import csv
import difflib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pairsim.runtime.child_process import descendants, module_command
from support.commands import words_of
from support.inputs import TINY

RUN = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\nlength: 3\nends: developed\nmesh: {Np: 8}\n"
RUN += "time: {end: 0.3, max_step: 0.01}\noutput: {checkpoint: 0, frames: 20}\n"
CURVE = "beta: 0.4\nDe: 0\nCa_e: 0.05\nlength: 3\nends: developed\nmesh: {Np: 8}\ntol: 1\n"
CURVE += "d: {start: 0.1, stop: 0.4, num: 12}\n"
Outcome = dict[str, str]


def _texts(folder: Path, *names: str) -> Outcome:
    """The content of files that must be the same to the last byte."""
    return {name: (folder / name).read_text() for name in names}


def _run(folder: Path) -> Outcome:
    assert json.loads((folder / "run.json").read_text())["status"] == "finished"
    return _texts(folder, "series.csv", "fields.xdmf", "case.yaml")


def _rounded(folder: Path) -> Outcome:
    """On several processes sums differ by rounding."""
    assert json.loads((folder / "run.json").read_text())["status"] == "finished"
    with (folder / "series.csv").open() as file:
        rows = [
            {name: f"{float(row[name]):.7f}" for name in ("t", "d", "U_L", "U_T", "dp")} for row in csv.DictReader(file)
        ]
    return {"series.csv": json.dumps(rows)}


def _curve(folder: Path) -> Outcome:
    assert json.loads((folder / "run.json").read_text())["status"] == "finished"
    return _texts(folder, "curve.csv", "equilibria.csv", "case.yaml")


def _sweep(folder: Path) -> Outcome:
    """The table without wall times, and the series of every case."""
    with (folder / "results.csv").open() as file:
        rows = [{name: value for name, value in row.items() if name != "wall_time"} for row in csv.DictReader(file)]
    assert {row["status"] for row in rows} == {"finished"}
    series = {str(path.relative_to(folder)): path.read_text() for path in folder.glob("*/series.csv")}
    return {"results.csv": json.dumps(rows), **series}


@dataclass(frozen=True)
class Kind:
    """A kind of command that is killed.

    Attributes:
        file: Text of its input file.
        begin: Words of the command.
        again: Words of the command that is given after it was killed.
        read: Reads and checks the outcome.
        ranks: Number of MPI processes, 0 without mpirun.
    """

    file: str
    begin: tuple[str, ...]
    again: tuple[str, ...]
    read: Callable[[Path], Outcome]
    ranks: int = 0


RESUMED = ("run", "in.yaml", "--resume", "out", "-q")
GRID = TINY + "grid: {d0: [0.1, 0.2, 0.3]}\n"
SWEPT = ("sweep", "in.yaml", "-o", "out", "-q")
KINDS = {
    "run": Kind(RUN, ("run", "in.yaml", "-o", "out", "-q"), RESUMED, _run),
    "mpirun": Kind(RUN, ("run", "in.yaml", "-o", "out", "-q"), RESUMED, _rounded, ranks=2),
    "curve": Kind(
        CURVE, ("curve", "in.yaml", "-o", "out", "-q"), ("curve", "in.yaml", "-o", "out", "-q", "--overwrite"), _curve
    ),
    "sweep": Kind(GRID, SWEPT, SWEPT, _sweep),
}


class Victim:
    """A kind of command in a folder, whose undisturbed outcome and duration are found first."""

    def __init__(self, name: str, folder: Path) -> None:
        self.kind, self.folder = KINDS[name], folder
        (folder / "in.yaml").write_text(self.kind.file)
        begin = time.monotonic()
        self._finish(self.kind.begin)
        self.seconds = time.monotonic() - begin
        self.outcome = self.kind.read(folder / "out")

    def _command(self, words: tuple[str, ...]) -> list[str]:
        mpirun = [str(Path(sys.executable).parent / "mpirun"), "-n", str(self.kind.ranks)] if self.kind.ranks else []
        return [*mpirun, *module_command("pairsim", *words)]

    def _finish(self, words: tuple[str, ...]) -> None:
        done = subprocess.run(
            self._command(words), cwd=self.folder, capture_output=True, text=True, timeout=600, check=False
        )
        assert done.returncode == 0, done.stderr
        assert "Traceback" not in done.stderr

    def kill(self, moment: float, chance: random.Random) -> bool:
        """Begin afresh, kill after some seconds, give the command again and compare the outcome.

        Args:
            moment: Seconds after the beginning.
            chance: Chooses the process to kill, of those of mpirun.

        Returns:
            Whether it was still running.
        """
        shutil.rmtree(self.folder / "out")
        process = subprocess.Popen(
            self._command(self.kind.begin), cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        with suppress(subprocess.TimeoutExpired):
            process.wait(moment)
        family = descendants(process.pid)
        alive = process.poll() is None
        if alive:
            with suppress(ProcessLookupError):
                os.kill(chance.choice(family) if self.kind.ranks else process.pid, signal.SIGKILL)
        # Ranks whose launcher was killed may go on to the end of the run.
        patience = 60 + 3 * self.seconds
        try:
            process.wait(patience)
        finally:
            process.kill()
        deadline = time.monotonic() + patience
        while any("pairsim" in words_of(pid) for pid in family):
            assert time.monotonic() < deadline, "a process goes on"
            time.sleep(0.02)
        self._finish(self.kind.again if (self.folder / "out").exists() else self.kind.begin)
        outcome = self.kind.read(self.folder / "out")
        for name, text in self.outcome.items():
            changed = [*difflib.unified_diff(text.splitlines(), outcome[name].splitlines(), lineterm="", n=0)]
            assert not changed, f"{name}, killed after {moment:.3f} s: {changed[:6]}"
        assert outcome.keys() == self.outcome.keys()
        return alive

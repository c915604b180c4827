"""Commands that are killed again and again, and the outcomes that must not depend on it."""

from __future__ import annotations

import csv
import difflib
import json
import os
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pairsim.results.checkpoint import load
from pairsim.results.table_files import read_table
from pairsim.results.xdmf import read_frame, read_times
from pairsim.runtime.child_process import module_command
from support.commands import descendants, words_of
from support.inputs import TINY

RUN = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\nlength: 3\nends: developed\nmesh: {Np: 8}\n"
RUN += "time: {end: 0.3, max_step: 0.01}\noutput: {checkpoint: 0, frames: 20}\n"
CURVE = "beta: 0.4\nDe: 0\nCa_e: 0.05\nlength: 3\nends: developed\nmesh: {Np: 8}\ntol: 1\n"
CURVE += "d: {start: 0.1, stop: 0.4, num: 8}\n"
Outcome = dict[str, str]


def _texts(folder: Path, *names: str) -> Outcome:
    """The content of files that must be the same to the last byte."""
    return {name: (folder / name).read_text() for name in names}


def _run(folder: Path) -> Outcome:
    """The case, and the end to Newton's tolerance, which step sizes feel."""
    assert json.loads((folder / "run.json").read_text())["status"] == "finished"
    end = {name: values[-1] for name, values in read_table(folder / "series.csv").items()}
    shown = f"t {end['t']:.6g}, d {end['d']:.4f}, dU {end['dU']:.5f}, {len(read_times(folder))} frames"
    return {**_texts(folder, "case.yaml"), "end": shown}


def _frames_are_kept(folder: Path) -> None:
    """After a kill of a run: all rows and frames that its checkpoint counts are there, and all frames are readable."""
    if (saved := load(folder)) is not None:
        assert len(read_table(folder / "series.csv")["t"]) >= saved.rows
        assert len(read_times(folder)) >= saved.frames
    for k in range(len(read_times(folder))):
        read_frame(folder, k)


def _table_is_whole(folder: Path) -> None:
    """After a kill of a curve or sweep: no table has an incomplete line."""
    for path in folder.glob("*.csv"):
        text = path.read_text()
        assert len({len(row) for row in csv.reader(text.splitlines())}) == 1, text
        assert text.endswith("\n")


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
        kept: Checks a folder after a kill.
        read: Reads and checks the outcome.
    """

    file: str
    begin: tuple[str, ...]
    again: tuple[str, ...]
    kept: Callable[[Path], None]
    read: Callable[[Path], Outcome]


RAN, RESUMED = ("run", "in.yaml", "-o", "out", "-q"), ("run", "in.yaml", "--resume", "out", "-q")
GRID = TINY + "grid: {d0: [0.1, 0.2, 0.3]}\n"
SWEPT, CURVED = ("sweep", "in.yaml", "-o", "out", "-q"), ("curve", "in.yaml", "-o", "out", "-q")
KINDS = {
    "run": Kind(RUN, RAN, RESUMED, _frames_are_kept, _run),
    "curve": Kind(CURVE, CURVED, (*CURVED, "--overwrite"), _table_is_whole, _curve),
    "sweep": Kind(GRID, SWEPT, SWEPT, _table_is_whole, _sweep),
}
PATIENCE = 300.0  # seconds within which processes must end or get on, also on a crowded machine


class Victim:
    """A kind of command in a folder; its undisturbed outcome and progress are found first.

    Its progress is the number of lines in its tables, so that the load of the machine makes no difference to the states
    in which it is killed.
    """

    def __init__(self, name: str, folder: Path) -> None:
        self.kind, self.folder, self.out = KINDS[name], folder, folder / "out"
        (folder / "in.yaml").write_text(self.kind.file)
        begin, process = time.monotonic(), self._start(self.kind.begin)
        self._wait_for(1, process, {})
        self.start = time.monotonic() - begin
        self._settle(process, [])
        self.rest = time.monotonic() - begin - self.start
        self.lines = self._lines({})
        self.outcome = self.kind.read(self.out)

    def _start(self, words: tuple[str, ...]) -> subprocess.Popen[bytes]:
        with (self.folder / "stderr").open("wb") as errors:
            return subprocess.Popen(
                module_command("pairsim", *words), cwd=self.folder, stdout=subprocess.DEVNULL, stderr=errors
            )

    @property
    def said(self) -> str:
        """Standard error of the last command."""
        return (self.folder / "stderr").read_text(errors="replace")

    def _tables(self) -> dict[Path, int]:
        """The tables and when they were written."""
        found = {}
        for path in self.out.rglob("*.csv"):
            with suppress(FileNotFoundError):
                found[path] = path.stat().st_mtime_ns
        return found

    def _lines(self, before: dict[Path, int]) -> int:
        """Number of lines in the tables that were written since `before`."""
        count = 0
        for path, when in self._tables().items():
            with suppress(FileNotFoundError):
                count += path.read_bytes().count(b"\n") if before.get(path) != when else 0
        return count

    def _wait_for(self, lines: int, process: subprocess.Popen[bytes], before: dict[Path, int]) -> None:
        deadline = time.monotonic() + PATIENCE
        while self._lines(before) < lines and process.poll() is None:
            assert time.monotonic() < deadline, f"no progress: {self.said}"
            time.sleep(0.005)

    def _settle(self, process: subprocess.Popen[bytes], family: list[int]) -> None:
        """Wait for the end of all processes."""
        try:
            process.wait(PATIENCE)
        finally:
            process.kill()
        deadline = time.monotonic() + PATIENCE
        while any("pairsim" in words_of(pid) for pid in family):
            assert time.monotonic() < deadline, "a process goes on"
            time.sleep(0.02)

    def _kill(self, words: tuple[str, ...], lines: int, chance: random.Random) -> bool:
        """Give a command and kill it.

        Args:
            words: Words of the command.
            lines: Number of lines in its tables after which it is killed, at a random moment before the next one.
            chance: Chooses the moment.

        Returns:
            Whether it was still running.
        """
        before = self._tables() if "--overwrite" in words else {}
        process = self._start(words)
        if lines:
            self._wait_for(lines, process, before)
        longest = self.start if not lines else self.rest / 4 if lines >= self.lines else 2 * self.rest / self.lines
        with suppress(subprocess.TimeoutExpired):
            process.wait(chance.uniform(0, longest))
        family = descendants(process.pid)
        alive = process.poll() is None
        if alive:
            with suppress(ProcessLookupError):
                os.kill(process.pid, signal.SIGKILL)
        self._settle(process, family)
        return alive

    def kill(self, count: int, chance: random.Random) -> tuple[int, int]:
        """Begin afresh, kill the command and those that continue it, let the last one finish, compare the outcome.

        Args:
            count: Number of kills, as long as it is not finished.
            chance: Chooses moments.

        Returns:
            The number of kills, and how many of them met a running process; one that did not is the last.
        """
        shutil.rmtree(self.out)
        words, met, history = self.kind.begin, 0, []
        for place in sorted(chance.choices(range(self.lines + 1), k=count)):
            done = self._lines({}) if self.out.exists() and "--overwrite" not in words else 0
            alive = self._kill(words, max(place, min(done + 1, self.lines)) if place else 0, chance)
            met += alive
            history.append(f"at line {place} of {self.lines}: {self.said.strip()}")
            words = self.kind.again if self.out.exists() else self.kind.begin
            self.kind.kept(self.out)
            if not alive:
                break
        process = self._start(words)
        self._settle(process, [])
        told = "\n".join(["", *history, f"at last: {self.said}"])
        assert process.returncode == 0, told
        assert "Traceback" not in told, told
        outcome = self.kind.read(self.out)
        assert outcome.keys() == self.outcome.keys(), told
        for name, text in self.outcome.items():
            changed = [*difflib.unified_diff(text.splitlines(), outcome[name].splitlines(), lineterm="", n=0)]
            assert not changed, f"{name}: {changed[:6]}{told}"
        return len(history), met

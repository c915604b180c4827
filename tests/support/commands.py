"""Run commands in this process, in a process of their own, and on several ranks."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from pairsim.runtime.child_process import module_command

Done = subprocess.CompletedProcess[str]
Pairsim = Callable[..., Done]


def in_process(folder: Path, arguments: tuple[str, ...], capture: pytest.CaptureFixture[str]) -> Done:
    """Run the command line in this process: which saves the time of imports.

    Args:
        folder: The current folder meanwhile.
        arguments: What follows `pairsim`.
        capture: What takes the output, also that of compiled libraries.

    Raises:
        KeyboardInterrupt: It was interrupted.
    """
    from pairsim.app.command_line import main

    before = process_state()
    capture.readouterr()
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(sys, "argv", ["pairsim", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
    code, (out, err) = int(ended.value.code or 0), capture.readouterr()
    if code == 130:
        raise KeyboardInterrupt  # the signal was meant for pytest; the command has caught it
    assert process_state() == before, "the next test would begin otherwise"
    return subprocess.CompletedProcess(["pairsim", *arguments], code, out, err)


def process_state() -> tuple[object, ...]:
    """State that a command might change: current folder, environment, signal handlers."""
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    return Path.cwd(), dict(os.environ), handlers


def apart(folder: Path, *arguments: str, ranks: int = 0, timeout: float = 600) -> Done:
    """Run the command in a process of its own; `ranks` puts mpirun in front."""
    mpirun = [str(Path(sys.executable).parent / "mpirun"), "-n", str(ranks)] if ranks else []
    command = [*mpirun, *module_command("pairsim", *arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=timeout, check=False)


@contextlib.contextmanager
def at_work(table: Path, *words: str) -> Iterator[subprocess.Popen[str]]:
    """A running command whose table has some rows; its folder is one below that in which the command was typed."""
    command, folder = module_command("pairsim", *words), table.parents[1]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        while not table.exists() or table.read_text().count("\n") < 5:
            assert process.poll() is None, process.stderr and process.stderr.read()
            time.sleep(0.02)
        yield process
    finally:
        process.kill()
        process.wait()


def interrupted(words: list[str], table: Path, number: int) -> dict[str, Any]:
    """run.json of a command that was sent a signal at work; it ends in order.

    SIGTERM is repeated until the end: schedulers send several.
    """
    with at_work(table, *words) as process:
        process.send_signal(number)
        deadline = time.monotonic() + 250
        while number == signal.SIGTERM and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.02)
            process.send_signal(number)
        _, complaint = process.communicate(timeout=250)
    assert process.returncode == 130
    assert "Traceback" not in complaint
    record: dict[str, Any] = json.loads((table.parent / "run.json").read_text())
    assert record["status"] == "interrupted"
    return record


def descendants(pid: int) -> list[int]:
    """Ids of a process and all its descendants, parents before children."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError, ValueError, IndexError):
            parent = int(stat.read_text().rpartition(")")[2].split()[1])
            children.setdefault(parent, []).append(int(stat.parent.name))
    found = [pid]
    for process in found:
        found += children.get(process, [])
    return found


def words_of(pid: int) -> list[str]:
    """Command line of a process, [""] if there is none."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_text().split("\0")
    except OSError:
        return [""]

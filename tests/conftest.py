"""Fixtures and hooks of the tests; shared functions are in `support`."""

from __future__ import annotations

import importlib
from collections import defaultdict
from pathlib import Path

import pytest
from support.commands import Done, Pairsim, apart, in_process

SLOWEST = 10
"""Number of the tests that are named at the end."""


def pytest_sessionstart(session: pytest.Session) -> None:
    """Import MPI through pairsim first, as the commands do."""
    if not session.config.pluginmanager.hasplugin("dsession"):  # which starts workers and runs no test itself
        importlib.import_module("pairsim.runtime.fenicsx")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say which tests were the slowest, and how long each tier took in all processes together."""
    seconds: defaultdict[str, float] = defaultdict(float)
    for reports in terminalreporter.stats.values():
        for report in reports:
            if isinstance(report, pytest.TestReport):
                seconds[report.nodeid.removeprefix("tests/")] += report.duration
    tiers: defaultdict[str, float] = defaultdict(float)
    for name, duration in seconds.items():
        tiers[name.partition("/")[0]] += duration
    if len(tiers) == 1:
        return
    terminalreporter.section("seconds, summed over processes")
    for each in (tiers, seconds):
        for name in sorted(each, key=each.__getitem__, reverse=True)[:SLOWEST]:
            terminalreporter.write_line(f"{each[name]:7.1f}  {name}")


@pytest.fixture
def pairsim(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> Pairsim:
    """Runs the command in an empty folder: in this process, or with `ranks` under mpirun."""

    def run(*arguments: str, ranks: int = 0, timeout: float = 600) -> Done:
        if ranks:
            return apart(tmp_path, *arguments, ranks=ranks, timeout=timeout)
        return in_process(tmp_path, arguments, capfd)

    return run


@pytest.fixture
def pairsim_apart(tmp_path: Path) -> Pairsim:
    """Runs the command in an empty folder, in its own process, for tests about processes."""

    def run(*arguments: str, timeout: float = 600) -> Done:
        return apart(tmp_path, *arguments, timeout=timeout)

    return run


@pytest.fixture
def decoys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Makes the empty folder the current one, with a folder and modules in it that are named like those of a child.

    Returns:
        A file that exists once one of them has been executed.
    """
    executed = tmp_path / "executed"
    (tmp_path / "pairsim").mkdir()
    for name in ("yaml", "numpy", "pydantic"):
        (tmp_path / f"{name}.py").write_text(f"open({str(executed)!r}, 'w').close()\nraise ImportError('a decoy')\n")
    monkeypatch.chdir(tmp_path)
    return executed

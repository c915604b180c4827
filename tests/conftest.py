"""Fixtures and hooks of the tests; shared functions are in `support`."""

from __future__ import annotations

import importlib
import subprocess
from pathlib import Path

import pytest
from support.commands import Done, Pairsim, apart, in_process

from pairsim.fem.form_cache import missing
from pairsim.runtime.child_process import module_command

LAWS = ("giesekus", "oldroyd-b", "ptt-linear", "ptt-exp", "fene-p")
FORMS = [
    *("neo-hookean", "newtonian:moving", "newtonian:fixed", "giesekus:moving", "giesekus:moving:steady"),
    *(f"{law}:fixed" for law in LAWS),
    "fene-p:moving",
    *(
        f"{kind}:enriched"
        for kind in ("newtonian:moving", "neo-hookean", "giesekus:moving:steady", "fene-p:moving:steady")
    ),
    *(f"{kind}:recovered" for kind in ("newtonian:moving", "neo-hookean", "giesekus:moving")),
]
"""Kinds of forms that the tests solve with."""


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile all forms before the workers of pytest-xdist start, which then only load them.

    A process that runs tests imports MPI through pairsim first, as the commands do.
    """
    if not hasattr(session.config, "workerinput") and (forms := missing(FORMS)):
        subprocess.run(module_command("pairsim.fem.form_cache", *forms), check=True)
    if not session.config.pluginmanager.hasplugin("dsession"):  # which starts workers and runs no test itself
        importlib.import_module("pairsim.runtime.fenicsx")


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

"""Fixtures and hooks of the tests; shared functions are in `support`."""

from __future__ import annotations

import importlib
from collections import Counter
from pathlib import Path

import pytest
from support.commands import Done, Pairsim, apart, in_process


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--rewrite-messages", action="store_true", help="write what commands say into mistakes.yaml")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Import MPI through pairsim first, as the commands do."""
    if not session.config.pluginmanager.hasplugin("dsession"):  # which starts workers and runs no test itself
        importlib.import_module("pairsim.runtime.fenicsx")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with most slow tests come first: short ones are left for the processes that have nothing else to do."""
    slow = Counter(item.path for item in items if item.get_closest_marker("slow"))
    items.sort(key=lambda item: -slow[item.path])


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


@pytest.fixture(scope="session")
def atlas(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of an atlas of invented curves."""
    from support.atlases import make_atlas

    path = tmp_path_factory.mktemp("atlas") / "atlas.npz"
    make_atlas().save(path)
    return path

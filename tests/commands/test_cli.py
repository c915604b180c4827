"""The command line itself: version, examples in the help, and no import of large libraries before they are needed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command
from typer.testing import CliRunner

import pairsim
from pairsim.cli.app import app

COMMANDS = sorted(get_command(app).commands)  # type: ignore[attr-defined]
HEAVY = ("dolfinx", "gmsh", "matplotlib", "mpi4py", "numpy", "petsc4py", "pyvista", "scipy", "ufl")


def test_version_is_that_of_the_package() -> None:
    result = CliRunner().invoke(app, ["--version"])
    assert result.exit_code == 0
    assert result.output.strip() == f"pairsim {pairsim.__version__}"


def test_help_lists_every_command() -> None:
    result = CliRunner().invoke(app, ["--help"])
    assert result.exit_code == 0
    assert len(COMMANDS) == 13
    assert all(command in result.output for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_an_example(command: str) -> None:
    result = CliRunner().invoke(app, [command, "--help"])
    assert result.exit_code == 0
    assert f"pairsim {command} " in result.output.partition("Example")[2]


@pytest.mark.parametrize("command", ["run", "sweep", "study", "curve", "critical"])
def test_help_names_the_default_folder(command: str) -> None:
    shown = CliRunner().invoke(app, [command, "--help"]).output
    assert "runs/<name>" in shown


@pytest.mark.parametrize(
    "arguments", [["--help"], ["run", "--help"], ["schema"], ["run", "nowhere.yaml"], ["sweep", "nowhere.yaml"]]
)
def test_nothing_heavy_is_imported_too_early(arguments: list[str], tmp_path: Path) -> None:
    """Help and input errors are immediate."""
    code = (
        "import atexit, sys; "
        f"atexit.register(lambda: print('imported:', *[n for n in {HEAVY!r} if n in sys.modules], file=sys.stderr)); "
        f"sys.argv[1:] = {arguments!r}; from pairsim.cli.app import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == (2 if "nowhere.yaml" in arguments else 0)
    assert done.stderr.splitlines()[-1].split() == ["imported:"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"])
@pytest.mark.parametrize("wanted", [None, "3"])
def test_threads_are_pinned_unless_chosen(name: str, wanted: str | None) -> None:
    environment = {} if wanted is None else {name: wanted}
    code = f"import os, pairsim; print(os.environ[{name!r}])"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == (wanted or "1")

"""The command line itself: version, examples in the help, and no import of large libraries before they are needed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import typer
from typer.main import get_command
from typer.testing import CliRunner

from pairsim.app import question_commands
from pairsim.app.command_line import app, command_of
from pairsim.computing import progress
from pairsim.questions.registry import NAMES
from pairsim.runtime.child_process import module_command

COMMANDS = sorted(get_command(app).commands)  # type: ignore[attr-defined]
HEAVY = ("dolfinx", "gmsh", "matplotlib", "meshio", "mpi4py", "pandas", "pyvista")
FOR_FEW = ("h5py", "matplotlib.animation", "matplotlib.pyplot", "meshio", "pandas", "pint", "pyvista", "seaborn")
"""What few commands need, and a curve does not."""


def test_help_lists_every_command() -> None:
    result = CliRunner().invoke(app, ["--help"])
    assert result.exit_code == 0
    assert {*NAMES, "units", "sweep"} < {*COMMANDS}
    assert all(command in result.output for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_an_example_and_all_its_words(command: str) -> None:
    result = CliRunner().invoke(app, [command, "--help"])
    assert result.exit_code == 0
    assert f"pairsim {command} " in result.output.partition("Example")[2]
    declared = command_of(command) if command in NAMES else get_command(app).commands[command]  # type: ignore[attr-defined]
    words = [declared.help, *(parameter.help for parameter in declared.params if hasattr(parameter, "help"))]
    assert not re.search(r"(?<!\\)\[[a-z]", "".join(map(str, words))), "rich would take a word in brackets for a style"


@pytest.mark.parametrize("arguments", [["run", "--help"], ["sweep", "nowhere.yaml"]])
def test_nothing_heavy_is_imported_too_early(arguments: list[str], tmp_path: Path) -> None:
    """Help and input errors are immediate."""
    code, imported = _imported(arguments, HEAVY, tmp_path)
    assert (code, imported) == (2 if "nowhere.yaml" in arguments else 0, [])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_curve_imports_only_what_it_uses(tmp_path: Path) -> None:
    keys = "d: [0.1, 0.11], max_points: 2, ends: developed, length: 3, mesh: {Np: 8}"
    (tmp_path / "case.yaml").write_text(f"{{beta: 0.4, De: 0, Ca_e: 0.1, {keys}}}")
    assert _imported(["curve", "case.yaml", "-o", "out"], FOR_FEW, tmp_path) == (0, [])
    assert (tmp_path / "out" / "curve.png").exists()


def _imported(arguments: list[str], watched: tuple[str, ...], folder: Path) -> tuple[int, list[str]]:
    """Exit code of a command, and which of the modules it has imported."""
    code = (
        "import atexit, sys; "
        f"atexit.register(lambda: print('imported:', *[n for n in {watched!r} if n in sys.modules], file=sys.stderr)); "
        f"sys.argv[1:] = {arguments!r}; from pairsim.app.command_line import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stderr.splitlines()[-1].split()[1:]


def test_a_reader_that_ends_early_is_no_error(tmp_path: Path) -> None:
    command = " ".join(module_command("pairsim", "schema"))
    words = ["bash", "-c", f"{command} | head -n 1"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (len(done.stdout.splitlines()), done.stderr) == (1, "")


def test_threads_are_pinned_unless_chosen() -> None:
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    code = f"import os, pairsim; print(*(os.environ[name] for name in {names!r}))"
    chosen = {names[1]: "3"}
    done = subprocess.run([sys.executable, "-c", code], env=chosen, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1", "3", "1"]


def test_time_left_is_that_at_the_latest_pace(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A tenth in the first 90 s and a tenth in the next 10 s: eight more tenths take 80 s, not 400 s."""
    now = 1000.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    reporter = progress.Reporter(shown=True)
    reporter.start("beads", "to t = 2", 2.0)
    now = 1060.0
    reporter.on_the_way("De = 0.5")
    now = 1070.0  # solved, and solved again on smaller cells
    reporter.on_the_way("De = 0.6", known=True)
    for seconds, t in ((90.0, 0.2), (92.0, 0.25), (100.0, 0.4)):
        now = 1000.0 + seconds
        reporter.update(t, f"t = {t:g}", 2)
    now = 1108.0  # a line on the way is no step from which the pace would count
    reporter.on_the_way("De = 1")
    now = 1120.0
    reporter.update(0.8, "t = 0.8", 3)
    assert capsys.readouterr().err.splitlines() == [
        "beads: to t = 2",
        "no result yet, solving easier cases first: De = 0.5",
        "    0%  working on: De = 0.6",
        "   10%  t = 0.2  (1 min 30 s, 13 min 30 s left)",
        "   20%  t = 0.4  (1 min 40 s, 1 min 20 s left)",
        "   20%  working on: De = 1",
        "   40%  t = 0.8  (2 min 00 s, 1 min 00 s left)",
    ]


def test_a_terminal_that_is_gone_changes_no_exit_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def echo(text: str, err: bool = False) -> None:
        raise OSError("Input/output error")

    monkeypatch.setattr(typer, "echo", echo)
    ended: Any = SimpleNamespace(
        question=SimpleNamespace(draws_from=None), reason="interrupted", status="interrupted", message="", advice=""
    )
    with pytest.raises(typer.Exit) as stopped:
        question_commands._end(ended, tmp_path, False)
    assert stopped.value.exit_code == 130

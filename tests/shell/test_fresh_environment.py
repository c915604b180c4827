"""Every command and script works with what pairsim declares and no more.

Tests of the usual tier hide the modules that only the tools of the tests bring; those marked `long` make a copy of the
project, and begin in it with `scripts/pairsim --version`.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from support import first_day
from support.declared import undeclared
from support.inputs import ROOT

from pairsim.app.command_line import app
from pairsim.runtime.child_process import clean_environment

HIDING = """
from importlib.machinery import PathFinder

whole = PathFinder.find_spec

def find_spec(name, path=None, target=None):
    return None if name.partition(".")[0] in {hidden} else whole(name, path, target)

PathFinder.find_spec = staticmethod(find_spec)  # petsc4py makes an object of the class
"""
"""A sitecustomize.py, which Python runs at its start."""
SCRIPTS = sorted(path for path in (ROOT / "scripts").iterdir() if path.is_file() and not path.suffix)
OF_USERS = [each.name for each in SCRIPTS if re.search(r"^setup_venv fenicsx$", each.read_text(), re.MULTILINE)]
"""Scripts that need no more than scripts/pairsim installs."""
OTHERS = [each.name for each in SCRIPTS if each.name not in OF_USERS]
WORDS = {"study": "all --quick --only ^$ -o {folder}", "pairsim": "--version", "docs": "-q --site-dir {folder}"}
"""What a script is started with in place of --help: studies are loaded, and none of their parts is computed."""


def done(words: list[str | Path], cwd: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment whose Python does not find what pairsim does not declare, and takes no deprecated call."""
    folder = tmp_path_factory.mktemp("hiding")
    (folder / "sitecustomize.py").write_text(HIDING.format(hidden=undeclared()))
    path = os.pathsep.join((str(folder), str(ROOT)))
    return clean_environment() | {"PYTHONPATH": path, "PYTHONWARNINGS": "error::DeprecationWarning"}


def test_tools_of_the_tests_are_hidden(bare: dict[str, str], tmp_path: Path) -> None:
    for name, code in {"yaml": 1, "pytest": 1, "xarray": 1, "pandas": 0, "ruamel.yaml": 0}.items():
        assert done([sys.executable, "-c", f"import {name}"], tmp_path, bare).returncode == code, name


def test_lines_of_the_first_day_have_every_command() -> None:
    names = set(typer.main.get_command(app).commands)
    assert names == {first_day.command_of(line) for line in first_day.LINES} - {"--version"}


@pytest.mark.slow
def test_every_command_works_with_what_is_declared(bare: dict[str, str], tmp_path: Path) -> None:
    ended = done([sys.executable, first_day.__file__, ROOT], tmp_path, bare)
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in OF_USERS if (ROOT / "scripts" / f"{name}.py").exists()])
def test_every_script_starts_with_what_is_declared(name: str, bare: dict[str, str], tmp_path: Path) -> None:
    words = shlex.split(WORDS.get(name, "--help").format(folder=tmp_path / "out"))
    ended = done([sys.executable, ROOT / "scripts" / f"{name}.py", *words], tmp_path, bare)
    assert "Traceback" not in ended.stderr, ended.stderr
    assert ended.returncode in ((0, 1) if name == "study" else (0,)), ended.stdout + ended.stderr


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project as it is, in which `scripts/pairsim --version` has been called."""
    folder = tmp_path_factory.mktemp("fresh") / "pairsim"
    listed = done(["git", "ls-files", "--cached", "--others", "--exclude-standard"], ROOT, dict(os.environ)).stdout
    for name in listed.splitlines():
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    ended = done([folder / "scripts" / "pairsim", "--version"], folder, of_users(folder))
    assert re.match(r"pairsim \d", ended.stdout), ended.stderr
    return folder


def of_users(folder: Path) -> dict[str, str]:
    """An environment without that of the tests, with a cache of its own."""
    left_out = ("PYTHONPATH", "VIRTUAL_ENV")
    kept = {name: value for name, value in clean_environment().items() if name not in left_out}
    return kept | {"XDG_CACHE_HOME": str(folder.parent / "cache")}


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_every_command_works_on_a_fresh_copy(fresh: Path, tmp_path: Path) -> None:
    python = fresh / ".venv" / "bin" / "python"
    for name in ("yaml", "pytest"):
        assert done([python, "-c", f"import {name}"], tmp_path, of_users(fresh)).returncode == 1, name
    script = shutil.copy(first_day.__file__, tmp_path)
    ended = done([python, script, fresh], tmp_path, of_users(fresh))
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", [*OF_USERS, *OTHERS])
def test_every_script_works_on_a_fresh_copy(name: str, fresh: Path, tmp_path: Path) -> None:
    """Those of users first; of the others `docs` installs what it needs, and the rest say how they are used."""
    words = shlex.split(WORDS.get(name, "--help").format(folder=tmp_path / "out"))
    ended = done([fresh / "scripts" / name, *words], tmp_path, of_users(fresh))
    assert "Traceback" not in ended.stderr, ended.stderr
    assert ended.returncode in ((0, 1) if name == "study" else (0,)), ended.stdout + ended.stderr

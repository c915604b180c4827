"""An incomplete installation gives a message of one line without a traceback."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from support.inputs import ROOT
from typer.testing import CliRunner

from pairsim.app.command_line import app
from pairsim.runtime import version
from pairsim.runtime.child_process import module_command

CASE = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n"
WITHOUT = {
    "MPI": (
        {
            "mpi4py/__init__.py": "",
            "mpi4py/MPI.py": "raise RuntimeError('cannot load MPI library\\n' + 'libmpi.so: no such file\\n' * 40)",
        },
        ("MPI cannot be loaded (cannot load MPI library)", "pip install 'pairsim[fenicsx]'"),
    ),
    "libraries of gmsh": (
        {"gmsh.py": "raise OSError('libGLU.so.1: cannot open shared object file')"},
        ("gmsh cannot be loaded (libGLU.so.1", "apt install libgl1 libglu1-mesa"),
    ),
}


@pytest.mark.parametrize("lacking", WITHOUT)
def test_missing_library_is_one_line(lacking: str, tmp_path: Path) -> None:
    modules, expected = WITHOUT[lacking]
    for name, text in modules.items():
        path = tmp_path / "site" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "case.yaml").write_text(CASE)
    search = os.pathsep.join([str(tmp_path / "site"), os.environ.get("PYTHONPATH", "")])
    command, environment = module_command("pairsim", "run", "case.yaml"), {**os.environ, "PYTHONPATH": search}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 4
    assert len(done.stderr.splitlines()) == 1
    assert all(part in done.stderr for part in expected)
    assert not (tmp_path / "runs").exists()


@pytest.fixture
def set_up(tmp_path: Path) -> Callable[[str], subprocess.CompletedProcess[str]]:
    """Runs lines of shell after a copy of scripts/setup.sh; programs of the folder `bin` come first on PATH."""
    (tmp_path / "scripts").mkdir()
    (tmp_path / "bin").mkdir()
    (tmp_path / "scripts" / "setup.sh").write_text((ROOT / "scripts" / "setup.sh").read_text())
    environment = {"HOME": str(tmp_path), "PATH": f"{tmp_path / 'bin'}:/usr/bin:/bin"}

    def run(lines: str) -> subprocess.CompletedProcess[str]:
        script = f"source {tmp_path}/scripts/setup.sh\n{lines}"
        return subprocess.run(
            ["bash", "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )

    return run


def program(folder: Path, name: str, text: str) -> None:
    (folder / name).write_text(f"#!/bin/bash\n{text}\n")
    (folder / name).chmod(0o755)


ONLY_OLD = 'find_python() { return 1; }\nis_new_enough() { [ "$1" = /new/python ]; }\n'
"""Shell: no interpreter of the machine is new enough."""


def test_uv_brings_a_python_where_none_is_new_enough(tmp_path: Path, set_up: Callable) -> None:
    uv = 'case "$*" in --version) ;; "python install"*) ;; "python find 3.13") echo /new/python ;; *) exit 1 ;; esac'
    program(tmp_path / "bin", "uv", uv)
    done = set_up(ONLY_OLD + "python_of_uv")
    assert (done.returncode, done.stdout.strip()) == (0, "/new/python")
    assert "uv installs 3.13" in done.stderr


def test_without_python_and_uv_one_sentence_says_what_to_do(tmp_path: Path, set_up: Callable) -> None:
    for name in ("python3", "python", "uv"):
        program(tmp_path / "bin", name, "exit 1")
    program(tmp_path / "bin", "cc", "exit 0")
    (tmp_path / "pyproject.toml").touch()
    done = set_up(ONLY_OLD + "find_uv() { return 1; }\nsetup_venv fenicsx")
    assert done.returncode == 1
    assert "no Python 3.12 or newer with venv was found, and uv could not bring one" in done.stderr
    assert len(done.stderr.splitlines()) == 1


COMMANDS = sorted(path.name for path in (ROOT / "scripts").iterdir() if path.is_file() and not path.suffix)


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "pairsim"])
def test_help_of_a_script_installs_nothing(name: str, tmp_path: Path) -> None:
    for path in (ROOT / "scripts" / name, ROOT / "scripts" / f"{name}.py", ROOT / "scripts" / "setup.sh"):
        (tmp_path / "scripts").mkdir(exist_ok=True)
        if path.is_file():
            shutil.copy(path, tmp_path / "scripts")
    words = [tmp_path / "scripts" / name, "--quick", "--help"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=10, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(done.stdout) > 80
    assert not (tmp_path / ".venv").exists()
    assert not (tmp_path / ".venv.lock").exists()


def test_conda_pixi_and_pip_install_the_same_packages() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    renamed = {"gmsh": "python-gmsh", "matplotlib": "matplotlib-base"}
    wanted = {}
    for entry in project["dependencies"]:
        name, bound = re.fullmatch(r"([\w.-]+)(.*)", entry).groups()
        wanted[renamed.get(name.lower(), name.lower())] = bound
    environment = yaml.safe_load((ROOT / "environment.yml").read_text())["dependencies"]
    conda = dict((*entry.split(" ", 1), "")[:2] for entry in environment)
    pixi = tomllib.loads((ROOT / "pixi.toml").read_text())["dependencies"]
    assert {name: conda.get(name) for name in wanted} == wanted
    assert {name: str(pixi.get(name)).replace("*", "") for name in wanted} == wanted
    assert conda["fenics-dolfinx"] == pixi["fenics-dolfinx"] == "0.11.*"
    assert "dolfinx-solver-real==0.11.*" in project["optional-dependencies"]["fenicsx"]


def test_version_names_the_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = CliRunner().invoke(app, ["--version"]).output
    assert re.fullmatch(rf"pairsim {version.__version__}( \(commit [0-9a-f]+\))?\n", said)
    monkeypatch.setattr("importlib.resources.files", lambda _: tmp_path)
    for written, commit in (("1234abc\n", "1234abc"), ("$Format:%h$\n", "")):
        (tmp_path / "commit.txt").write_text(written)
        assert version.commit() == commit

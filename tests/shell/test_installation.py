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
from packaging.specifiers import SpecifierSet
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


SET_UP = (ROOT / "scripts" / "setup.sh").read_text()
ONLY_OLD = 'find_python() { return 1; }\nis_new_enough() { [ "$1" = /new/python ]; }\n'
"""Shell: no interpreter of the machine is new enough."""


def test_uv_brings_a_python_where_none_is_new_enough(tmp_path: Path, set_up: Callable) -> None:
    uv = 'case "$*" in --version) ;; "python install"*) ;; "python find 3.13") echo /new/python ;; *) exit 1 ;; esac'
    program(tmp_path / "bin", "uv", uv)
    done = set_up(ONLY_OLD + "python_of_uv")
    assert (done.returncode, done.stdout.strip()) == (0, "/new/python")
    assert "uv can download 3.13" in done.stderr


def test_without_python_and_uv_two_sentences_say_what_to_do(tmp_path: Path, set_up: Callable) -> None:
    for name in ("python3", "python", "uv"):
        program(tmp_path / "bin", name, "exit 1")
    program(tmp_path / "bin", "cc", "exit 0")
    (tmp_path / "pyproject.toml").touch()
    done = set_up(ONLY_OLD + "find_uv() { return 1; }\nsetup_venv fenicsx")
    assert done.returncode == 1
    lacking, advice = done.stderr.splitlines()
    assert "no Python 3.12 or newer with the module venv was found" in lacking
    assert "install 3.12 or newer (on Debian and Ubuntu python3-venv, too), or set PAIRSIM_PYTHON" in advice


UV_WITHOUT_NETWORK = """case "$*" in
    --version) ;;
    *--quiet*) exit 1 ;;
    *) echo no network >&2; exit 1 ;;
esac"""


def test_why_uv_fails_is_told(tmp_path: Path, set_up: Callable) -> None:
    program(tmp_path / "bin", "uv", UV_WITHOUT_NETWORK)
    done = set_up(ONLY_OLD + "python_of_uv")
    assert done.returncode == 1
    assert "no network" in done.stderr


def test_a_chosen_python_that_is_too_old_is_not_replaced_by_another(tmp_path: Path, set_up: Callable) -> None:
    program(tmp_path / "bin", "old", "exit 1")
    done = set_up("find_python() { echo /other/python; }\nPAIRSIM_PYTHON=old choose_python")
    assert (done.returncode, done.stdout) == (1, "")
    assert "PAIRSIM_PYTHON is old, which is no Python 3.12 or newer" in done.stderr


@pytest.mark.parametrize(("system", "machine"), [("Darwin", "arm64"), ("Linux", "aarch64")])
def test_where_there_is_no_wheel_other_ways_are_named(
    system: str, machine: str, tmp_path: Path, set_up: Callable
) -> None:
    program(tmp_path / "bin", "uname", f'case "$1" in -s) echo {system} ;; -m) echo {machine} ;; esac')
    program(tmp_path / "bin", "cc", "exit 0")
    (tmp_path / "pyproject.toml").touch()
    done = set_up("choose_python() { echo python; }\nhas_fenicsx() { return 1; }\nsetup_venv fenicsx")
    assert done.returncode == 1
    assert "docs/how-to/install.md has others: conda, pixi, a container" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / ".venv").exists()


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


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.fixture
def conda() -> dict[str, str]:
    """The packages of environment.yml with what is said of their versions."""
    entries = yaml.safe_load((ROOT / "environment.yml").read_text())["dependencies"]
    return dict((*entry.split(" ", 1), "")[:2] for entry in entries)


@pytest.fixture
def pixi() -> dict[str, str]:
    """Those of pixi.toml, in the words of environment.yml."""
    entries = tomllib.loads((ROOT / "pixi.toml").read_text())["dependencies"]
    words = {name: f"* {each['build']}" if isinstance(each, dict) else each for name, each in entries.items()}
    return {name: "" if each == "*" else each for name, each in words.items()}


def test_conda_pixi_and_pip_install_the_same_packages(conda: dict[str, str], pixi: dict[str, str]) -> None:
    renamed = {"gmsh": "python-gmsh", "matplotlib": "matplotlib-base"}
    wanted = {}
    for entry in PROJECT["dependencies"]:
        name, bound = re.fullmatch(r"([\w.-]+)(.*)", entry).groups()
        wanted[renamed.get(name.lower(), name.lower())] = bound
    assert {name: conda.get(name) for name in wanted} == wanted
    assert pixi == {name: bound for name, bound in conda.items() if name != "pip"}
    assert conda["fenics-dolfinx"] == "0.11.*"
    assert "dolfinx-solver-real==0.11.*" in PROJECT["optional-dependencies"]["fenicsx"]


def test_every_way_of_installation_has_a_python_that_is_new_enough(conda: dict[str, str]) -> None:
    oldest = PROJECT["requires-python"]
    assert conda["python"].startswith(f"{oldest},")
    images = re.findall(r"^FROM python:([\d.]+)", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    assert images
    assert all(SpecifierSet(oldest).contains(version) for version in images)
    assert SpecifierSet(oldest).contains(re.search(r"^uv_python=(\S+)", SET_UP, re.MULTILINE)[1])


def packages(path: Path) -> set[str]:
    """What the first command of apt in a file installs."""
    command = re.search(r"apt(?:-get)? install (?:--\S+ )*((?:.*\\\n)*.*)", path.read_text())[1]
    return set(command.partition("&&")[0].replace("\\\n", " ").split())


def test_the_system_needs_the_same_packages_everywhere() -> None:
    needed = packages(ROOT / "README.md")
    assert packages(ROOT / "docs" / "how-to" / "install.md") == needed
    of_image = packages(ROOT / "Dockerfile")  # which has Python; without recommended packages gcc lacks libgomp1
    assert of_image - {"libgomp1"} == needed - {"python3-pip", "python3-venv"}
    message = (ROOT / "pairsim" / "runtime" / "fenicsx.py").read_text()
    assert set(re.findall(r"\blib[a-z]\S*\d(?:-mesa)?\b", message)) == of_image - {"gcc", "libc6-dev", "libgomp1"}


def test_the_container_is_built_of_what_is_copied_into_it() -> None:
    copied = re.findall(r"^COPY (?!--from)(.*) \S+$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    ignored, *kept = (ROOT / ".dockerignore").read_text().split()
    assert ignored == "*"
    assert {name.removeprefix("!") for name in kept} == {name for line in copied for name in line.split()}


def test_version_names_the_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = CliRunner().invoke(app, ["--version"]).output
    assert re.fullmatch(rf"pairsim {version.__version__}( \(commit [0-9a-f]+\))?\n", said)
    monkeypatch.setattr("importlib.resources.files", lambda _: tmp_path)
    for written, commit in (("1234abc\n", "1234abc"), ("$Format:%h$\n", "")):
        (tmp_path / "commit.txt").write_text(written)
        assert version.commit() == commit

"""Commands of scripts/ import no more than pairsim depends on, and what they install themselves."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from packaging.utils import canonicalize_name
from support.declared import PROJECT, distributions, known
from support.inputs import ROOT

FOLDER = ROOT / "scripts"
SCRIPTS = sorted(path for path in FOLDER.rglob("*.py") if not path.stem.startswith("pyoomph"))
"""All modules but those that are run in the environment of another code."""
COMMANDS = {"validation_book": "validation", "studies": "study", "docs_math": "docs", "docs_reference": "docs"}
"""The command that a folder or module is part of, where it is not named after it."""
OWN = {PROJECT["name"], *(path.name.removesuffix(".py") for path in FOLDER.iterdir()), "pyoomph_pair"}
"""Modules of the project."""
OF_USERS = ("fenicsx", "cytometry", "netcdf")  # extras of users; the package imports the last two when they are needed


def imported(path: Path) -> Iterator[str]:
    """The top-level modules that a file imports anywhere, but for those of Python and of this project."""
    for node in ast.walk(ast.parse(path.read_text())):
        names = [each.name for each in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level else []
        for name in (each.partition(".")[0] for each in names):
            if name not in sys.stdlib_module_names and name not in OWN:
                yield name


def extras_of(path: Path) -> tuple[str, ...]:
    """The extras that the command of a module installs; of modules that several share, what every one has."""
    part = path.relative_to(FOLDER).parts[0].removesuffix(".py")
    command = FOLDER / COMMANDS.get(part, part)
    asked = re.search(r"^setup_venv (\S+)$", command.read_text(), re.MULTILINE) if command.is_file() else None
    return tuple(asked[1].split(",")) if asked else ("fenicsx",)


def lacking(path: Path, extras: tuple[str, ...]) -> set[str]:
    """The modules that a file imports, and that nothing brings which is installed by then."""
    there = distributions(extras)
    return {name for name in imported(path) if not there & known().get(name, {canonicalize_name(name)})}


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: str(path.relative_to(FOLDER)))
def test_a_script_imports_what_its_command_has_installed(path: Path) -> None:
    assert lacking(path, extras_of(path)) == set()


def test_the_package_imports_what_it_depends_on() -> None:
    found = {str(path): lacking(path, OF_USERS) for path in sorted((ROOT / PROJECT["name"]).rglob("*.py"))}
    assert {name: each for name, each in found.items() if each} == {}


def test_what_is_not_installed_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text("def read():\n    import yaml\n    from pytest import approx\n")
    assert lacking(tmp_path / "script.py", ("fenicsx",)) == {"yaml", "pytest"}
    assert not lacking(tmp_path / "script.py", ("fenicsx", "dev"))

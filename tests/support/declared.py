"""The packages that pyproject.toml declares, with what these need in turn, and the modules that they bring."""

from __future__ import annotations

import sys
import tomllib
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path
from unittest import mock

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from support.inputs import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
OF_USERS = ("fenicsx",)
"""The extras that scripts/pairsim installs."""
OF_PYTHON = {"pip", PROJECT["name"]}
"""Distributions of every environment."""


@cache
def distributions(extras: tuple[str, ...]) -> set[str]:
    """The names of what pairsim depends on with some extras, and of what these need in turn."""
    project: dict[str, list[str]] = PROJECT["optional-dependencies"]
    wanted = [Requirement(each) for each in PROJECT["dependencies"]]
    wanted += [Requirement(each) for extra in extras for each in project[extra]]
    found: set[str] = set()
    while wanted:
        one = wanted.pop()
        if one.name == PROJECT["name"]:
            wanted += [Requirement(each) for extra in one.extras for each in project[extra]]
        elif (name := canonicalize_name(one.name)) not in found:
            found.add(name)
            with suppress(PackageNotFoundError):  # what only scripts/mutation installs
                needed = map(Requirement, requires(name) or ())
                wanted += [each for each in needed if each.marker is None or each.marker.evaluate({"extra": ""})]
    return found


@cache
def known() -> dict[str, set[str]]:
    """The names of the distributions that bring each installed module.

    Importing setuptools appends its own copies of packages to `sys.path`. They are left out, as they are not installed.
    """
    installed = [each for each in sys.path if "_vendor" not in Path(each).parts]
    with mock.patch.object(sys, "path", installed):
        found = packages_distributions()
    return {module: set(map(canonicalize_name, names)) for module, names in found.items()}


def undeclared() -> set[str]:
    """The installed modules that the environment of a user does not have."""
    there = distributions(OF_USERS) | OF_PYTHON
    return {module for module, names in known().items() if not names & there}

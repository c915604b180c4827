"""Hashes of the files of packages, which are stored with results to identify the code of which these are.

Comments, docstrings and the layout of lines do not enter a hash. A package may be named with the laws that a study
uses, by the names of their files, such as pairsim.physics[newtonian,neo_hookean]: other laws do not enter then. Or it
is named with packages inside it that do not enter, such as pairsim.fem[-azimuthal].
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from book.computing import ROOT

SHOWN = 10  # digits of a hash
UNKNOWN = "unknown code"
"""The code of results whose code was not recorded; where their commit is known, it is "commit " with its hash."""


def code_of(uses: Sequence[str]) -> str:
    """The names of packages or modules with their hashes, such as "pairsim.fem 12ab34cd56, pairsim.physics ..."."""
    return ", ".join(f"{name} {_digest(name)}" for name in uses)


def reasons(before: str, now: str) -> list[str]:
    """Why results of one code are stale with another, such as "pairsim.fem has changed"; empty where they are not."""
    if not {each.partition(" ")[0] for each in before.split(", ")} & {
        each.partition(" ")[0] for each in now.split(", ")
    }:
        return [f"they are of {before}"]
    return [f"{name} has changed" for name in changed(before, now)]


def changed(before: str, now: str) -> list[str]:
    """The names in the later one of two results of `code_of` whose hash in the earlier one differs, or is missing."""
    earlier, later = (dict(each.split(" ") for each in code.split(", ") if each) for code in (before, now))
    return [name for name in later if earlier.get(name) != later[name]]


def _digest(name: str) -> str:
    package, _, inside = name.removesuffix("]").partition("[")
    names = inside.split(",") if inside else []
    without = tuple(each[1:] for each in names if each.startswith("-"))
    laws = tuple(each for each in names if not each.startswith("-"))
    return digest_of(ROOT.joinpath(*package.split(".")), laws or None, without)


@cache
def digest_of(place: Path, laws: tuple[str, ...] | None = None, without: tuple[str, ...] = ()) -> str:
    """The hash of a package (a folder with all below it) or of a module (without its ending).

    Args:
        place: The folder, or the path of the file without ".py".
        laws: Names of files of laws; files of other laws are left out. None for all.
        without: Names of folders in it that are left out.

    Raises:
        FileNotFoundError: There is no such package, module, law or folder.
    """
    files = sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]
    for folder in without:
        if not (place / folder).is_dir():
            raise FileNotFoundError(f"{place} has no folder {folder}")
        files = [path for path in files if place / folder not in path.parents]
    if laws is not None:
        of_laws = {path.stem: path for path in files if _has_law(path)}
        if unknown := set(laws) - of_laws.keys():
            raise FileNotFoundError(f"{place} has no laws {', '.join(sorted(unknown))}")
        files = [path for path in files if path.stem in laws or path != of_laws.get(path.stem)]
    parts = (f"{path.relative_to(place.parent).as_posix()}\n{_without_docstrings(path)}" for path in files)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:SHOWN]


def _without_docstrings(path: Path) -> str:
    """The syntax tree of a file without strings that stand alone, which document what is beside them."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        for name, body in ast.iter_fields(node):
            if isinstance(body, list):
                setattr(node, name, [each for each in body if not _is_text(each)])
    return ast.dump(tree)


def _is_text(node: object) -> bool:
    if not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
        return False
    return isinstance(node.value.value, str)


@cache
def _has_law(path: Path) -> bool:
    """Whether a file has a law, which is a class with a label."""
    classes = [node for node in ast.parse(path.read_text(encoding="utf-8")).body if isinstance(node, ast.ClassDef)]
    lines = [line for node in classes for line in node.body if isinstance(line, ast.Assign)]
    return any(isinstance(name, ast.Name) and name.id == "label" for line in lines for name in line.targets)

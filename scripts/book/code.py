"""Names of code: hashes of the files of packages, by which results say what they were computed with.

Comments, docstrings and the layout of lines are no part of it.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from book.computing import ROOT

SHOWN = 10  # digits of a hash


def code_of(uses: Sequence[str]) -> str:
    """The names of packages or modules with their hashes, such as "pairsim.fem 12ab34cd56, pairsim.physics ..."."""
    return ", ".join(f"{name} {digest_of(ROOT.joinpath(*name.split('.')))}" for name in uses)


def changed(before: str, now: str) -> list[str]:
    """The packages whose hashes differ between two results of `code_of`."""
    earlier, later = (dict(each.split(" ") for each in code.split(", ") if each) for code in (before, now))
    return [name for name in earlier | later if earlier.get(name) != later.get(name)]


@cache
def digest_of(place: Path) -> str:
    """The hash of a package (a folder with all below it) or of a module (without its ending).

    Raises:
        FileNotFoundError: There is neither.
    """
    files = sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]
    parts = (f"{path.relative_to(place.parent).as_posix()}\n{_without_docstrings(path)}" for path in files)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:SHOWN]


def _without_docstrings(path: Path) -> str:
    """The syntax tree of a file; strings that stand alone document what is beside them."""
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

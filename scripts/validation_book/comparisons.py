"""Comparisons of computed values with references, and what a subject of the book has computed."""

from __future__ import annotations

import importlib.util
import json
import math
import sys
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import yaml
from book.computing import DOCS, ROOT

from pairsim.api.results import Result

BOOK, CONFIGS = DOCS / "validation", ROOT / "configs" / "validation"
REFERENCES = BOOK / "references.yaml"


Keys = dict[str, Any]
"""Keys of a case and arguments of `pairsim.curve` and its like."""


@dataclass(frozen=True)
class Reference:
    """A value to compare with, and the key of its source in references.yaml."""

    value: float
    source: str


@cache
def references() -> dict[str, Any]:
    """The content of references.yaml."""
    return dict(yaml.safe_load(REFERENCES.read_text()))


def reference(group: str, key: str) -> Reference:
    """A value of references.yaml.

    Raises:
        KeyError: There is none.
    """
    found = references()["groups"][group]
    return Reference(float(found["values"][key]), found["source"])


@dataclass(frozen=True)
class Comparison:
    """One computed value beside its reference.

    Attributes:
        what: The scene, in words.
        quantity: Symbol of the value.
        value: The computed value.
        error: Half-width of the interval that it comes with, None without one.
        exact: The reference.
        source: Key of its source, or its source in words.
        allowed: Largest difference relative to the reference, absolute if that is 0; the interval does not widen it.
        headline: Whether it is in the table of the index page.
        table: Name of the table of the page.
    """

    what: str
    quantity: str
    value: float
    error: float | None
    exact: float
    source: str
    allowed: float
    headline: bool = False
    table: str = "comparison"

    @property
    def difference(self) -> float:
        """Computed minus reference."""
        return self.value - self.exact

    @property
    def relative(self) -> float:
        """Difference over the reference, NaN if that is 0."""
        return self.difference / abs(self.exact) if self.exact else math.nan

    @property
    def good(self) -> bool:
        """Whether the difference is as small as allowed."""
        return bool(abs(self.difference) <= self.allowed * (abs(self.exact) or 1.0))


def against(known: Reference, what: str, quantity: str, value: float, allowed: float, **more: Any) -> Comparison:
    """A comparison with a value of references.yaml; `more` are `error`, `headline` and `table`."""
    settings = {"error": None} | more
    return Comparison(what, quantity, float(value), exact=known.value, source=known.source, allowed=allowed, **settings)


def text_table(head: list[str], rows: list[list[str]]) -> dict[str, list[Any]]:
    """A further table of a page, as text."""
    return {"head": head, "rows": rows}


@dataclass(frozen=True)
class Found:
    """What a subject has computed.

    Attributes:
        comparisons: Values beside their references.
        tables: Further tables by name.
        notes: Sentences by name, for numbers in running text.
    """

    comparisons: list[Comparison]
    tables: dict[str, dict[str, list[Any]]] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)

    def text(self) -> str:
        """As JSON."""
        return json.dumps(asdict(self), indent=1, allow_nan=False) + "\n"

    @staticmethod
    def read(path: Path) -> Found:
        """From a file that `text` has written."""
        content = json.loads(path.read_text())
        return Found([Comparison(**each) for each in content["comparisons"]], content["tables"], content["notes"])


@dataclass(frozen=True)
class Setting:
    """How a subject is computed.

    Attributes:
        quick: Coarse cells and few points, as a test.
        folder: Folder for the files of cases.
        pictures: Folder for pictures.
    """

    quick: bool
    folder: Path
    pictures: Path


def number(value: float, digits: int = 6) -> str:
    """A number for a table."""
    return f"{value:.{digits}g}"


def verification(name: str) -> ModuleType:
    """A module of tests/verification, whose functions solve what its tests check."""
    path = ROOT / "tests" / "verification" / f"{name}.py"
    if str(ROOT / "tests") not in sys.path:
        sys.path.insert(0, str(ROOT / "tests"))  # the package `support`
    spec = importlib.util.spec_from_file_location(f"verification_{name}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def rows_of(result: Result) -> list[dict[str, float]]:
    """The rows of the table of a finished computation.

    Raises:
        RunFailure: It failed.
    """
    return [{str(key): value for key, value in row.items()} for row in result.check().table.to_dict("records")]

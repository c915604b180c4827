"""A page of the validation book: its cases, and the values that are compared, by configs/validation/book.yaml."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from math import nan, pi
from pathlib import Path
from types import ModuleType
from typing import Any

import matplotlib as mpl
import pandas as pd
from book import yaml_files
from book.cases import Case
from book.computing import CONFIGS, DOCS, ROOT

import pairsim

mpl.use("Agg")
BOOK, FOLDER = DOCS / "validation", CONFIGS / "validation"
PAGES: dict[str, dict[str, Any]] = yaml_files.read(FOLDER / "book.yaml")
REFERENCES: dict[str, Any] = yaml_files.read(BOOK / "references.yaml")


@dataclass
class Page:
    """A page that is being computed.

    Attributes:
        name: Its name in book.yaml.
        folder: Folder for the results of cases; those that are there are computed again.
        pictures: Folder for pictures.
        quick: Whether cases are few and coarse, as a test.
        workers: Cases at the same time.
    """

    name: str
    folder: Path
    pictures: Path
    quick: bool
    workers: int
    _cases: dict[str, list[Case]] = field(default_factory=dict)
    _rows: dict[str, pd.DataFrame] = field(default_factory=dict)

    def cases(self, sweep: str) -> list[Case]:
        """The cases of a sweep, which are computed at the first call.

        Raises:
            RunFailure: One failed that may not.
        """
        if sweep not in self._cases:
            grid = dict(PAGES[self.name]["sweeps"][sweep])
            quick, may_fail = grid.pop("quick", {}), grid.pop("may_fail", False)
            grid |= (quick if self.quick else {}) | {"base": str(FOLDER / grid["base"])}
            shutil.rmtree(self.folder / sweep, ignore_errors=True)
            found = pairsim.sweep(grid, folder=self.folder / sweep, workers=self.workers, progress=True).cases
            self._cases[sweep] = [Case(result if may_fail else result.check()) for result in found]
        return self._cases[sweep]

    def rows(self, of: str) -> pd.DataFrame:
        """What a function MODULE.FUNCTION of this package returns, or the rows of all cases of a sweep."""
        if of not in self._rows:
            module, _, function = of.partition(".")
            if function:
                self._rows[of] = getattr(import_module(f"validation_book.{module}"), function)(self)
            else:
                self._rows[of] = pd.concat([rows_of(case) for case in self.cases(of)], ignore_index=True)
        return self._rows[of]

    def tables(self) -> dict[str, pd.DataFrame]:
        """The tables of the page; those that compare have a row for each value."""
        tables = PAGES[self.name]["tables"].items()
        wanted = {name: table for name, table in tables if not self.quick or table.get("quick", True)}
        return {name: compared(self.rows(table["of"]), table) for name, table in wanted.items()}

    def save_picture(self, figure: Any) -> None:
        """Write the picture of the page."""
        figure.tight_layout()
        figure.savefig(self.pictures / f"{self.name}.png", dpi=150)


def rows_of(case: Case) -> pd.DataFrame:
    """The rows of a case with those of its keys that are no columns."""
    scalars = {key: value for key, value in case.parameters.items() if isinstance(value, int | float | str)}
    return case.table.assign(**{key: value for key, value in scalars.items() if key not in case.table}, pi=pi)


def compared(rows: pd.DataFrame, table: Mapping[str, Any]) -> pd.DataFrame:
    """A row for each value: keys, `column`, `value`, `error`, `reference` and what difference is `allowed`."""
    found = []
    for column, how in table.get("compare", {}).items():
        here = rows.query(how["where"]) if "where" in how else rows
        own = here[table.get("keys", [])].assign(column=column, value=evaluated(here, how.get("value", column)))
        for name, key in (("error", "error"), ("reference", "to"), ("allowed", "allowed")):
            own[name] = evaluated(here, how.get(key))
        found.append(own)
    return pd.concat(found, ignore_index=True) if found else rows


def evaluated(rows: pd.DataFrame, expression: Any) -> Any:
    """A column, an expression of columns, or GROUP: KEY of references.yaml for every row; NaN for None."""
    if expression is None or expression in rows.columns:
        return nan if expression is None else rows[expression]
    group, _, key = str(expression).partition(": ")
    if group not in REFERENCES["groups"]:
        return rows.eval(str(expression))
    values = REFERENCES["groups"][group]["values"]
    keys = (key.format(**{str(name): value for name, value in row.items()}) for row in rows.to_dict("records"))
    return [float(values.get(each, nan)) for each in keys]


@cache
def verification(name: str) -> ModuleType:
    """A module of tests/physics or tests/verification, whose functions solve what its tests check."""
    sys.path[:0] = [str(ROOT / "tests" / folder) for folder in ("", "physics", "verification")]
    return import_module(name)

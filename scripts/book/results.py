"""Stored results of a study: rows of its parts in one CSV file, with hashes of the code that each part depends on."""

from __future__ import annotations

import datetime
import hashlib
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from book.code import SHOWN, reasons
from book.study import Part, Row
from pairsim.record.folder import write_text

OWN = ["part", "identity", "code", "computed"]
"""The first columns."""


class Results:
    """The rows of parts.

    Args:
        path: Their file, which is written anew with each part.
        others: Further files, from which the rows of parts are taken that this file lacks.
    """

    def __init__(self, path: Path, *others: Path) -> None:
        self.path, self.table = path, pd.DataFrame(columns=OWN)
        for file in (each for each in (path, *others) if each.is_file()):
            found = _read(file)
            self.table = _joined(self.table, found[~found["part"].isin(self.table["part"])])

    def code(self, part: Part) -> str | None:
        """The code that a part was computed with; None where it has no rows."""
        own = self.of([part])
        return str(own["code"].iloc[0]) if len(own) else None

    def stale(self, part: Part, code: str) -> list[str] | None:
        """Reasons why the rows of a part are stale with some code, empty if they are not; None if it has no rows."""
        before = self.code(part)
        return None if before is None else reasons(before, code)

    def add(self, part: Part, code: str, rows: Sequence[Row]) -> None:
        """Store the rows of a part in the place of earlier ones."""
        day = datetime.date.today().isoformat()
        new = pd.DataFrame(rows).assign(part=part.name, identity=_digest(part), code=code, computed=day)
        self.table = _joined(self.table[self.table["part"] != part.name], new)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        _write(self.path, self.table)

    def of(self, parts: Sequence[Part]) -> pd.DataFrame:
        """The rows of those parts that have the same identity as when they were stored, in the order of `parts`."""
        identities = {part.name: _digest(part) for part in parts}
        same = self.table["identity"] == self.table["part"].map(identities)
        order = {name: place for place, name in enumerate(identities)}
        return self.table[same].sort_values("part", key=lambda each: each.map(order), kind="stable", ignore_index=True)

    def store(self, path: Path, parts: Sequence[Part]) -> None:
        """Write the rows of parts into another file."""
        _write(path, self.of(parts))


def _read(path: Path) -> pd.DataFrame:
    """A file; the code of a part is that of its first row."""
    found = pd.read_csv(path)
    return found.assign(code=found.groupby("part")["code"].transform("first"))


def _write(path: Path, table: pd.DataFrame) -> None:
    """Write a file, in which the code of a part is in its first row alone."""
    known = table.assign(code=table["code"].mask(table["part"].duplicated()))
    write_text(path, known.to_csv(index=False, float_format="%.12g"))


def _joined(table: pd.DataFrame, rows: pd.DataFrame) -> pd.DataFrame:
    """Rows below others, with `OWN` as the first columns."""
    both = pd.concat([table, rows], ignore_index=True) if len(table) else rows
    return both[[*OWN, *(name for name in both.columns if name not in OWN)]]


def _digest(part: Part) -> str:
    return hashlib.sha256(part.identity.encode()).hexdigest()[:SHOWN]

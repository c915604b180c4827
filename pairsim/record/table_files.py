"""Reader and writer of tables as CSV files, without pandas, whose import takes as long as solving a case."""

from __future__ import annotations

import csv
import io
import json
import math
from bisect import insort
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.record.column import Columns
from pairsim.record.folder import naming, write_text
from pairsim.record.table import NOTHING_DECLARED, Cell, Table
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

FLAGS = {"true": True, "false": False}


def read_table(path: Path | str, declared: Columns = NOTHING_DECLARED, *, missing_ok: bool = False) -> Table:
    """Read a table, also while it is being written: an incomplete last line is skipped.

    Args:
        path: The CSV file.
        declared: The columns that it may have.
        missing_ok: Whether a missing file is read as a table without columns.

    Returns:
        An array of shape (rows,) for each column, in the order of the header: of floats (nan in empty cells), of bool
        (true and false), or of text.

    Raises:
        InputError: The file is missing, has no header, or has a row with another number of values than the header.
    """
    file = Path(path)
    if missing_ok and not file.exists():
        return Table({}, declared)
    try:
        text = file.read_text(encoding="utf-8-sig")  # spreadsheets write a byte-order mark first, and TRUE for true
        names, *rows = csv.reader(text[: text.rfind("\n") + 1].splitlines()) if "\n" in text else [[]]
        if not names or not all(names):
            raise ValueError("no column names")
        columns = zip(*rows, strict=True) if rows else ((),) * len(names)
        return Table({name: _typed(entries) for name, entries in zip(names, columns, strict=True)}, declared)
    except (OSError, ValueError, csv.Error) as error:
        allowed = f"must be a table of pairsim: column names, with values below them, separated by commas ({error})"
        raise InputError(str(file), "", None, allowed) from error


def _typed(entries: Sequence[str]) -> Array:
    if entries and {entry.lower() for entry in entries} <= FLAGS.keys():
        return np.array([FLAGS[entry.lower()] for entry in entries])
    try:
        return np.array([float(entry or "nan") for entry in entries])
    except ValueError:
        return np.array(entries)


def cell(value: Any) -> str:
    """A value in a table: numbers with full precision, None empty, lists with spaces between their entries."""
    if value is None or isinstance(value, str):
        return value or ""
    if isinstance(value, list):
        return " ".join(map(cell, value))
    if isinstance(value, dict):
        return json.dumps(value)
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    return repr(float(value)) if isinstance(value, float) else str(value)


def table_text(first: Iterable[Any], rows: Iterable[Iterable[Any]] = ()) -> str:
    """A table as CSV: a first line, such as the names of its columns, and rows of values, all written by `cell`."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(map(cell, row) for row in (first, *rows))
    return text.getvalue()


class TableWriter:
    """Writes a table row by row. After each row the file is complete, with `count` rows.

    Args:
        path: The file; an earlier one is replaced.
        columns: The names of the columns.
        rows: Rows to begin with.
        declared: The declarations of the columns, which say in which of them a number may be unknown (nan).
        ascending: Whether rows are sorted by their first columns, for which the whole file is written anew at each row;
            otherwise rows are appended.

    Raises:
        ValueError: As for `row`.
        OSError: The file cannot be written; the old file is kept.
    """

    def __init__(
        self,
        path: Path,
        columns: Sequence[str],
        rows: Iterable[Mapping[str, Cell]] = (),
        *,
        declared: Columns = NOTHING_DECLARED,
        ascending: bool = False,
    ) -> None:
        self._path, self._columns, self._ascending = path, tuple(columns), ascending
        self._unknown = {name for name in columns if (entry := declared.get(name)) is not None and entry.unknown}
        first = [self._values(row) for row in rows]
        self._sorted = sorted(first) if ascending else []
        self.count = len(first)
        write_text(path, table_text(columns, self._sorted or first))

    def row(self, values: Mapping[str, Cell]) -> None:
        """Add a row.

        Args:
            values: Values by column; those of columns that the table does not have are ignored.

        Raises:
            ValueError: A column has no value, or a number is infinite, or nan in a column that may not be unknown.
            OSError: The file cannot be written.
        """
        row = self._values(values)
        if self._ascending:
            insort(self._sorted, row)
            write_text(self._path, table_text(self._columns, self._sorted))
        else:
            with naming(self._path), self._path.open("a", encoding="utf-8") as file:
                file.write(table_text(row))
        self.count += 1

    def _values(self, row: Mapping[str, Cell]) -> list[Any]:
        if missing := [name for name in self._columns if name not in row]:
            raise ValueError(f"no value for {', '.join(missing)}")
        values = [row[name] for name in self._columns]
        for name, value in zip(self._columns, values, strict=True):
            if isinstance(value, float) and (math.isinf(value) or (math.isnan(value) and name not in self._unknown)):
                raise ValueError(f"{name} is {value}")
        return values

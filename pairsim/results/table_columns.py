"""Tables of commands for one case as arrays, without pandas, whose import takes as long as solving a small case."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError


def read_columns(table: Path) -> dict[str, Array]:
    """The columns of a table of a command for one case, by name; none where there is no table yet.

    An incomplete last line is skipped. Numbers are nan where nothing is known, flags are bool, words stay text.

    Raises:
        InputError: It is not a table.
    """
    try:
        text = table.read_text(encoding="utf-8") if table.is_file() else ""
        names, *rows = csv.reader(text[: text.rfind("\n") + 1].splitlines()) if text else [[]]
        columns = zip(*rows, strict=True) if rows else ((),) * len(names)
        return {name: _typed(entries) for name, entries in zip(names, columns, strict=True)}
    except (OSError, ValueError) as error:
        raise InputError(str(table), "", None, f"must be a table of pairsim ({error})") from error


def _typed(entries: Sequence[str]) -> Array:
    """A column of a table, from its text."""
    if entries and set(entries) <= {"true", "false"}:
        return np.array([entry == "true" for entry in entries])
    try:
        return np.array([entry or "nan" for entry in entries], dtype=float)
    except ValueError:
        return np.array(entries)

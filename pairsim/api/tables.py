"""Read CSV tables as pandas DataFrames."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from pairsim.results.columns import WHOLE
from pairsim.runtime.errors import InputError


def read_table(path: Path) -> pd.DataFrame:
    """Read a table of pairsim, also while it is being written: an incomplete last line is skipped.

    Args:
        path: The CSV file.

    Returns:
        The table. Counts are integers, `stable` and `certain` are booleans, JSON lists are parsed. If the file does not
        exist yet, the table has no columns and no rows.

    Raises:
        InputError: The file is not a table of pairsim.
    """
    try:
        return table_of_text(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return pd.DataFrame()
    except (OSError, ValueError) as error:
        raise InputError(str(path), "", None, f"must be a table of pairsim ({error})") from error


def table_of_text(text: str) -> pd.DataFrame:
    """As `read_table`, from the text of the file.

    Raises:
        ValueError: The text is not a table.
    """
    whole_lines = text[: text.rfind("\n") + 1]
    if not whole_lines:
        return pd.DataFrame()
    table = pd.read_csv(io.StringIO(whole_lines), float_precision="round_trip", keep_default_na=False, na_values=[""])
    for name in table.columns:
        if name in WHOLE and pd.api.types.is_numeric_dtype(table[name]):
            table[name] = table[name].astype("int64" if table[name].notna().all() else "Int64")
        elif pd.api.types.is_object_dtype(table[name]) or pd.api.types.is_string_dtype(table[name]):
            table[name] = table[name].map(_parsed)
    return table


def _parsed(cell: Any) -> Any:
    """Parse a list or object written as JSON; other values are returned unchanged."""
    if isinstance(cell, str) and cell[:1] in ("[", "{"):
        try:
            return json.loads(cell)
        except ValueError:
            pass
    return cell


def empty_table(columns: Sequence[str]) -> pd.DataFrame:
    """A table with these columns and no rows."""
    return pd.DataFrame(columns=list(columns))

"""CSV tables as pandas DataFrames."""

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
    """A table that pairsim wrote, perhaps is writing: a last line that is not finished is left out.

    Returns:
        The table; counts and flags are integers, `stable` and `certain` are truths, lists in JSON are lists. A table
        that does not exist yet has no columns and no rows.

    Raises:
        InputError: It cannot be read.
    """
    try:
        return table_of_text(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return pd.DataFrame()
    except (OSError, ValueError) as error:
        raise InputError(str(path), "", None, f"cannot be read as a table that pairsim wrote ({error})") from error


def table_of_text(text: str) -> pd.DataFrame:
    """As `read_table`, from the text of the file.

    Raises:
        ValueError: It is no table.
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
    """A list or group that was written as JSON; everything else as it is."""
    if isinstance(cell, str) and cell[:1] in ("[", "{"):
        try:
            return json.loads(cell)
        except ValueError:
            pass
    return cell


def empty_table(columns: Sequence[str]) -> pd.DataFrame:
    """A table without rows."""
    return pd.DataFrame(columns=list(columns))

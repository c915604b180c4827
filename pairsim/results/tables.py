"""Read CSV tables as pandas DataFrames."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from pairsim.results.columns import WHOLE
from pairsim.runtime.errors import InputError


def read_table(path: Path) -> pd.DataFrame:
    """Read a table of pairsim, also while it is being written: an incomplete last line is skipped.

    Args:
        path: The CSV file.

    Returns:
        The table. Counts are integers, `stable` and `certain` are booleans. If the file does not exist yet, the table
        has no columns and no rows.

    Raises:
        InputError: The file is not a table of pairsim.
    """
    try:
        text = path.read_text(encoding="utf-8")
        whole_lines = text[: text.rfind("\n") + 1]
        return whole_numbers(pd.read_csv(io.StringIO(whole_lines), float_precision="round_trip"))
    except (FileNotFoundError, pd.errors.EmptyDataError):
        return pd.DataFrame()
    except (OSError, ValueError) as error:
        raise InputError(str(path), "", None, f"must be a table of pairsim ({error})") from error


def whole_numbers(table: pd.DataFrame) -> pd.DataFrame:
    """The table with its counts and flags as integers."""
    for name in table.columns:
        if name in WHOLE and pd.api.types.is_numeric_dtype(table[name]):
            table[name] = table[name].astype("int64" if table[name].notna().all() else "Int64")
    return table


def empty_table(columns: Sequence[str]) -> pd.DataFrame:
    """A table with these columns and no rows."""
    return pd.DataFrame(columns=list(columns))

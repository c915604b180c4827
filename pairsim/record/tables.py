"""Tables as pandas frames: their units, conversion to physical units, and their text."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import pandas as pd

from pairsim.cases.physical import BLOCK
from pairsim.cases.quantity_text import numbers_in_one_unit
from pairsim.quantities.kinds import PURE
from pairsim.quantities.scales import Scales
from pairsim.record.column import Columns, Shown, suffixes_in
from pairsim.record.columns import DU
from pairsim.record.table import Table
from pairsim.record.table_files import cell, table_text

DIGITS = "{:.5g}".format
UNITS, SHOWN, HALF_WIDTHS = "units", "shown", "half_widths"
"""Entries of the `attrs` of frames, each a mapping from the names of columns to their unit, to where they are shown
(`Shown`), or to the column of their half-widths."""
ASCII = {ord("\N{GREEK SMALL LETTER MU}"): "u", ord("\N{MICRO SIGN}"): "u", ord("\N{MIDDLE DOT}"): "."}
"""Replacements by which units are written as in case files."""
MOST_ROWS = 40  # most rows of a table on the screen, unless all are asked for


def frame_of(table: Table) -> pd.DataFrame:
    """A table as a frame, in which counts are integers and `attrs["units"]` has the unit of each column."""
    return described(pd.DataFrame(dict(table)), table.declared)


def described(frame: pd.DataFrame, declared: Columns) -> pd.DataFrame:
    """The frame with its counts and flags as integers, and the declarations of its columns in `attrs`."""
    for name in frame.columns:
        whole = (entry := declared.get(str(name))) is not None and entry.whole
        if whole and pd.api.types.is_numeric_dtype(frame[name]):
            frame[name] = frame[name].astype("int64" if frame[name].notna().all() else "Int64")
    return with_units(frame, declared)


def with_units(frame: pd.DataFrame, declared: Columns, converted: Collection[str] = ()) -> pd.DataFrame:
    """The frame with the entries `UNITS`, `SHOWN` and `HALF_WIDTHS` of its `attrs`.

    Units are "" for pure numbers, physical ones for columns in `converted`, and dimensionless ones for all others.
    """
    known = {name: declared.get(name) for name in map(str, frame.columns)}
    units = {name: PURE if entry is None else entry.unit for name, entry in known.items()}
    frame.attrs[UNITS] = {name: unit.physical if name in converted else unit.name for name, unit in units.items()}
    frame.attrs[SHOWN] = {name: entry.shown.value for name, entry in known.items() if entry is not None}
    frame.attrs[HALF_WIDTHS] = {name: error for name in known if (error := declared.half_width(name)) in known}
    return frame


def in_units(
    frame: pd.DataFrame, declared: Columns, scales: Sequence[Scales], keys: Collection[str] = ()
) -> pd.DataFrame:
    """The frame in um, s, um/s, Pa and nN; cells may be lists.

    Args:
        frame: The frame.
        declared: The declarations of its columns.
        scales: The scales of the experiment of each row.
        keys: Columns that are not converted.

    Raises:
        TypeError: A column that has a unit holds something other than numbers.
    """
    converted: dict[str, list[Any]] = {}
    for name in (str(each) for each in frame.columns if each not in keys):
        if (entry := declared.get(name)) is not None and entry.unit.physical:
            rows = zip(frame[name], map(entry.unit.factor, scales), strict=True)
            converted[name] = [_times(value, size) for value, size in rows]
    return with_units(frame.assign(**converted), declared, converted)


def with_numbers(frame: pd.DataFrame, keys: Iterable[str]) -> pd.DataFrame:
    """The frame with quantities of an experiment, texts such as "5 kPa", as numbers.

    All numbers of a column have the unit of its first quantity, which is named in `attrs`; half-widths are left out.
    A column with anything else, such as quantities of two kinds, stays unchanged.
    """
    for key in (each for each in keys if each.startswith(f"{BLOCK}.") and each in frame):
        cells = [cell if isinstance(cell, list) else [cell] for cell in frame[key]]
        known = [text for cell in cells for text in cell if isinstance(text, str)]
        with suppress(ValueError):
            numbers, unit = numbers_in_one_unit(known)
            found = dict(zip(known, numbers, strict=True))
            if known:
                frame[key] = [_number(cell, found) for cell in frame[key]]
                frame.attrs[UNITS][key] = unit.translate(ASCII)
    return frame


def _number(cell: Any, numbers: Mapping[str, float]) -> Any:
    """The number of a quantity, or a list of those of several; nan if none is given."""
    return [_number(each, numbers) for each in cell] if isinstance(cell, list) else numbers.get(cell, math.nan)


def _times(value: Any, size: float) -> Any:
    """A number or list times a factor, with 12 digits: 0.0833333333333333 D_c becomes 5 um, not 4.999999999999998."""
    if isinstance(value, list):
        return [_times(each, size) for each in value]
    return value if value is None else float(f"{value * size:.12g}")


def stacked(frames: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Stack frames one below the other; in the rows of a frame that lacks a column, its values are missing."""
    found = pd.concat(frames, ignore_index=True)
    units, shown, half_widths = (
        {key: value for each in frames for key, value in each.attrs[of].items()} for of in (UNITS, SHOWN, HALF_WIDTHS)
    )
    found.attrs = {UNITS: {key: units.get(key, "") for key in found}, SHOWN: shown, HALF_WIDTHS: half_widths}
    return found


def csv_text(table: pd.DataFrame) -> str:
    """A table as CSV with 17 digits and the unit of each column after its name."""
    values = table.astype(object).where(table.notna(), None)
    return table_text(headings(table), values.itertuples(index=False))


def headings(table: pd.DataFrame) -> list[str]:
    """Names of the columns with their units."""
    units = table.attrs[UNITS]
    return [f"{name} [{units[name]}]" if units.get(name) else str(name) for name in table.columns]


def readable(frame: pd.DataFrame, whole: bool = False) -> pd.DataFrame:
    """The frame with its main columns, each followed by its half-widths; if `whole`, the others come after these.

    The main columns of a table of relative velocities are those that are always shown, and keys that vary; those of
    other tables are all that are not only shown on request.
    """
    names, known = [str(name) for name in frame.columns], frame.attrs.get(SHOWN, {})
    half_widths: Mapping[str, str] = frame.attrs.get(HALF_WIDTHS, {})
    errors, moving = {*half_widths.values()}, bool(suffixes_in(names, DU))
    shown = {Shown.ALWAYS.value, None} if moving else {Shown.ALWAYS.value, Shown.USUALLY.value, None}

    main = [name for name in names if known.get(name) in shown and name not in errors]
    main.sort(key=lambda name: moving and name.startswith("U"))
    ordered = [each for name in main for each in (name, half_widths.get(name)) if each is not None]
    return frame[[*ordered, *(name for name in names if whole and name not in ordered)]]


def brief(table: pd.DataFrame) -> pd.DataFrame:
    """The table for readers: units follow the names of columns, lists are separated by spaces, unknown cells empty."""

    def words(values: list[Any]) -> str:
        return " ".join(DIGITS(each) if isinstance(each, float) else cell(each) for each in values)

    def shown(value: Any) -> Any:
        if isinstance(value, list):
            return words(value)
        return "" if value is None or value is pd.NA else value

    joined = table.map(shown)
    return joined.set_axis([name.removeprefix("physical.") for name in headings(table)], axis="columns")


def screen_text(table: pd.DataFrame, width: int, whole: bool = False) -> str:
    """A table as text for a screen of `width` characters: five digits, and the main columns unless `whole`."""
    shown, rows = brief(readable(table, whole)), None if whole else MOST_ROWS
    return str(shown.to_string(index=False, max_rows=rows, line_width=width, float_format=DIGITS, na_rep=""))

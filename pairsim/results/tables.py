"""Tables of a folder as pandas frames: with units, converted to them, and as text."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pairsim.cases.yaml_file import read_yaml
from pairsim.quantities.kinds import PURE, Kind
from pairsim.quantities.scales import Scales
from pairsim.results.columns import SWEEP_COLUMNS, WHOLE, error_of, known, suffixes_in
from pairsim.results.curve_table import curve_of, over
from pairsim.results.folder import read_record
from pairsim.results.inputs import quantity_for
from pairsim.results.scales import no_units, scales_in
from pairsim.results.table_files import cell, read_table, table_text
from pairsim.results.travel import distance_on
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

INNER = re.compile(
    r"m|newton|wanted|mesh|meshes|distortion|volume_error|stretch|s_jump|(from_rest|ends_error|regularisation_error|creep).*|"
    r"\w*_correction.*"
)
"""Columns of interest to whoever judges the numerics; they come last, if at all."""
MAIN = re.compile(r"(De|Ca_e|position|t|d|dU|dU_error|U|F|F_error)(_\d+|_[LT])?")
"""What is shown of a table of relative velocities, unless all is asked for."""
DIGITS = "{:.5g}".format
IN_SWEEPS = {each.name: each.unit for each in SWEEP_COLUMNS}
"""The units of those columns of results.csv that no other table has."""
MOST_ROWS = 40  # of a table on a screen that is not asked for all


def frame_of(columns: Mapping[str, Array]) -> pd.DataFrame:
    """The columns of a table as a frame: counts are integers, and `attrs["units"]` has the unit of each column."""
    return with_units(whole_numbers(pd.DataFrame(dict(columns))))


def whole_numbers(table: pd.DataFrame) -> pd.DataFrame:
    """The table with its counts and flags as integers."""
    for name in table.columns:
        if name in WHOLE and pd.api.types.is_numeric_dtype(table[name]):
            table[name] = table[name].astype("int64" if table[name].notna().all() else "Int64")
    return table


def with_units(table: pd.DataFrame, converted: Collection[str] = ()) -> pd.DataFrame:
    """The table with `attrs["units"]`: the unit of each column by its name, "" for pure numbers.

    Columns that are converted have physical units.
    """
    units = {name: _unit_of(name) for name in map(str, table.columns)}
    table.attrs["units"] = {name: unit.physical if name in converted else unit.name for name, unit in units.items()}
    return table


def _unit_of(name: str) -> Kind:
    entry = known(name)
    return entry.unit if entry is not None else IN_SWEEPS.get(re.sub(r"_\d+$", "", name), PURE)


def in_units(table: pd.DataFrame, scales: Sequence[Scales], keys: Collection[str] = ()) -> pd.DataFrame:
    """The table in um, s, um/s, Pa and nN, by the scales of the experiment of each row; some columns stay as they are.

    Cells may be lists.

    Raises:
        TypeError: A column that has a unit has something else than numbers.
    """
    converted: dict[str, Any] = {}
    for name in (str(each) for each in table.columns if each not in keys):
        if (unit := _unit_of(name)).physical:
            rows = zip(table[name], map(unit.factor, scales), strict=True)
            converted[name] = [_times(value, size) for value, size in rows]
    return with_units(table.assign(**converted), converted)


def _times(value: Any, size: float) -> Any:
    """A number, or the numbers of a list, times a factor: 0.0833333333333333 D_c are 5 um, and no 4.999999999999998."""
    if isinstance(value, list):
        return [_times(each, size) for each in value]
    return value if value is None else float(f"{value * size:.12g}")


def table_of(directory: Path, name: str, physical: bool | None, at: Sequence[float | str] = ()) -> pd.DataFrame:
    """A table of a folder by its name without .csv, as of `pairsim.Result.frame`.

    Raises:
        InputError: The table cannot be read, or `physical` is set and its case has no `physical` block; as of
            `values_at`.
    """
    path, record = directory / f"{name}.csv", read_record(directory)
    scales = scales_in(record) if physical is not False else None
    if physical and scales is None:
        raise no_units(str(directory))
    try:
        table = table_from(read_table(path), record, str(directory), physical, at)
    except TypeError as error:
        raise InputError(str(path), "", None, f"must have numbers in its rows ({error})") from None
    if scales is not None and (along := (case := read_yaml(directory / "case.yaml")).get("along")):
        number = "De" if "De" in along else "Ca_e"
        key, unit, value_of = quantity_for(case, number, scales)
        table.insert(list(table).index(number), key, value_of(table[number]))
        table.attrs["units"][key] = unit
    return table


def table_from(
    columns: Mapping[str, Array],
    record: Mapping[str, Any],
    source: str,
    physical: bool | None,
    at: Sequence[float | str] = (),
) -> pd.DataFrame:
    """A table of columns, as of `pairsim.Result.frame`; the record, run.json, has the units. Messages name `source`.

    Raises:
        InputError: `physical` is set and there are no units; as of `values_at`.
        TypeError: A column that has a unit has something else than numbers.
    """
    scales = scales_in(record) if physical is not False else None
    if physical and scales is None:
        raise no_units(source)
    table = frame_of(values_at(columns, at, record, source) if at else columns)
    return table if scales is None else in_units(table, [scales] * len(table))


def values_at(
    table: Mapping[str, Array], places: Sequence[float | str], record: Mapping[str, Any], source: str
) -> dict[str, Array]:
    """The columns d, dU and dU_error of a curve at any distances: numbers [D_c], or lengths with their units.

    Units of the case are those in run.json; messages name `source`.

    Raises:
        InputError: It is no curve over a single distance, or a distance is outside of it.
    """
    found: dict[str, Array] = {}
    for gap in suffixes_in(table, "dU"):
        if (curve := curve_of(table, gap)) is None:
            break
        d = np.array([distance_on(curve, each, "--at", scales_in(record), source) for each in places])
        found |= {over(table, gap): d, f"dU{gap}": curve.values(d), error_of(f"dU{gap}"): curve.half_widths(d)}
    if not found:
        raise InputError(source, "--at", None, "goes with a curve of at least two points over a single distance")
    return found


def csv_text(table: pd.DataFrame) -> str:
    """A table as CSV with 17 digits and the unit of each column after its name."""
    values = table.astype(object).where(table.notna(), None)
    return table_text(headings(table), values.itertuples(index=False))


def headings(table: pd.DataFrame) -> list[str]:
    """Names of the columns with their units."""
    units = table.attrs["units"]
    return [f"{name} [{units[name]}]" if units.get(name) else str(name) for name in table.columns]


def readable(table: pd.DataFrame, whole: bool = False) -> pd.DataFrame:
    """The table with errors beside what they belong to; the columns of less interest come last if `whole`.

    Else they are left out: of relative velocities all but `MAIN` and keys that vary, of other tables `INNER`.
    """
    names = [str(name) for name in table.columns]
    errors, moving = {error_of(name) for name in names}, bool(suffixes_in(names, "dU"))

    def matters(name: str) -> bool:
        return bool(MAIN.fullmatch(name)) or known(name) is None if moving else not INNER.fullmatch(name)

    main = [name for name in names if matters(name) and name not in errors]
    main.sort(key=lambda name: moving and name.startswith("U"))
    ordered = [each for name in main for each in (name, error_of(name)) if each in names]
    return table[[*ordered, *(name for name in names if whole and name not in ordered)]]


def brief(table: pd.DataFrame) -> pd.DataFrame:
    """The table for readers: units after the names of columns, lists as numbers with spaces between, unknown empty."""

    def words(values: list[Any]) -> str:
        return " ".join(DIGITS(each) if isinstance(each, float) else cell(each) for each in values)

    def shown(value: Any) -> Any:
        if isinstance(value, list):
            return words(value)
        return "" if value is None or value is pd.NA else value

    joined = table.map(shown)
    return joined.set_axis([name.removeprefix("physical.") for name in headings(table)], axis="columns")


def screen_text(table: pd.DataFrame, width: int, whole: bool = False) -> str:
    """A table to be read on a screen of so many characters: five digits, and the main columns unless `whole`."""
    shown, rows = brief(readable(table, whole)), None if whole else MOST_ROWS
    return str(shown.to_string(index=False, max_rows=rows, line_width=width, float_format=DIGITS, na_rep=""))

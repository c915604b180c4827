"""Reads times and flow rates from the log of a pump: a table with headings, which have the units."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from pairsim.cases.quantity_text import unit_in
from pairsim.cases.values import MOST_VALUES
from pairsim.runtime.text import decoded

TIMES = re.compile(r"(elapsed|run|pump)?\W?(t|time|times|zeit|temps|tiempo|tempo|time ?stamps?|date ?time)", re.I)
FLOWS = re.compile(
    r"(measured|actual|pump(ed)?|volum\w*|mean|set)?\W?(q|flow\W?rates?|flow|rate|fluss(rate)?|flussrate|"
    r"volumenstrom|d[ée]bit|caudal|portata)(\W?(q|measured|actual|set))?",
    re.I,
)
HEADING = re.compile(r"(?P<name>[^\[\](){}]*?)\W*(?:[\[({/,]|\bin\b)\s*(?P<unit>[^\])}]+?)\s*[\])}]?\s*")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}([,.]\d{3})+")  # ambiguous: 1,000 may also have three decimals
MEASURED = re.compile(r"measured|actual", re.I)
FORM = re.compile(r"(h+:m+(:s+)?|m+:s+)(\W[\df s]+)?", re.I)  # of times such as 00:30, as in time [mm:ss]
SECONDS = {"h": 3600, "m": 60, "s": 1}  # by the first letters of the parts of such a form
SHORT_TIME = r"\d{1,2}:\d{2}([.,]\d+)?"
DAY_OR_MONTH = r"\d{1,2}([./-])\d{1,2}\1\d{2,4}\b.*"  # with points the day is first
NOT_A_NUMBER = float("nan")
SEPARATORS = "\t;,"
DATES = "date or time of day"
EXAMPLE = "such as time [s], flow rate [ul/min]"
SPELLED = {"µ": "u", "μ": "u", "minute": "min", "minutes": "min", "seconds": "s", "sec": "s"}


def read_pump_log(path: Path) -> tuple[list[str], list[str]]:
    """The times and flow rates of a file, each as a text with its unit.

    Raises:
        ValueError: The file has no such columns, a unit is missing or unknown, or a cell is not a number.
        OSError: The file cannot be read.
    """
    lines = decoded(path.read_bytes()).splitlines()
    start, separator, headings = _heading(lines)
    width = len(_row(lines[start], separator))
    rows = {
        number: _row(line, separator)
        for number, line in enumerate(lines[start + 1 :], start + 2)
        if line.strip(separator + " ")
    }
    if len(rows) > MOST_VALUES:
        raise ValueError(f"must have at most {MOST_VALUES:,} times, not {len(rows):,}: leave some out")
    (of_times, time_unit), (of_flows, flow_unit) = (
        _column(rows, headings[what], width, what) for what in ("time", "flow rate")
    )
    if FORM.fullmatch(time_unit):
        times, time_unit = _durations(of_times, time_unit), "s"
    elif time_unit:
        _check_unit("s", time_unit, "times")
        times = _numbers(of_times)
    else:
        times, time_unit = _clock(of_times), "s"
    _check_order(times, of_times)
    if not flow_unit:
        raise ValueError(f"must have the unit of its flow rates in their heading, {EXAMPLE}")
    _check_unit("m^3/s", flow_unit, "flow rates")
    flows = _numbers(of_flows)
    return [f"{t:.12g} {time_unit}" for t in times], [f"{q:.12g} {flow_unit}" for q in flows]


class Heading(NamedTuple):
    """A column of times or flow rates by its heading."""

    place: int  # from 0
    text: str
    unit: str


def _heading(lines: Sequence[str]) -> tuple[int, str, dict[str, list[Heading]]]:
    """The index of the line of headings, its separator, and the columns of each kind, "time" and "flow rate"."""
    for i, line in enumerate(lines):
        for separator in SEPARATORS:
            found: dict[str, list[Heading]] = {"time": [], "flow rate": []}
            for k, text in enumerate(_row(line, separator)):
                match = HEADING.fullmatch(text)
                name, unit = (match["name"].strip(), match["unit"]) if match else (text, "")
                for what, names in (("time", TIMES), ("flow rate", FLOWS)):
                    if names.fullmatch(name.replace("_", " ").strip()):
                        found[what].append(Heading(k, text, _unit(unit)))
            if all(found.values()):
                return i, separator, found
    raise ValueError(f"must have a line of headings, {EXAMPLE}, with one time and one flow rate")


def _column(
    rows: Mapping[int, Sequence[str]], headings: Sequence[Heading], width: int, what: str
) -> tuple[dict[int, str], str]:
    """The cells of a column and its unit. Of several, times are the first, and flow rates those that were measured.

    Raises:
        ValueError: Several columns have flow rates that differ, and it is not clear which are meant.
    """
    measured = [each for each in headings if MEASURED.search(each.text)]
    taken = measured[0] if len(measured) == 1 else headings[0]
    cells = _cells(rows, taken.place, width)
    if what != "time" and len(measured) != 1:
        others = [each for each in headings if _cells(rows, each.place, width) != cells or each.unit != taken.unit]
        if others:
            names = " and ".join(f'"{each.text}"' for each in headings)
            raise ValueError(f"must have one {what}, but has the columns {names}: remove or rename all but one")
    return cells, taken.unit


def _row(line: str, separator: str) -> list[str]:
    """The cells of a line; a separator within quotes is part of a cell."""
    return [cell.strip(" \"'") for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _unit(text: str) -> str:
    for sign, other in SPELLED.items():
        text = re.sub(rf"\b{sign}\b" if sign.isascii() else sign, other, text)
    return re.sub(r"\s*/\s*", "/", text.strip()).replace("/s.", "/s")


def _cells(rows: Mapping[int, Sequence[str]], column: int, width: int) -> dict[int, str]:
    """The cells of a column, by the numbers of their lines; `width` is the number of headings."""
    for number, row in rows.items():
        if len(row) <= column or any(row[width:]):  # empty cells at the end come from trailing separators
            fewer = "fewer" if len(row) <= column else "more"
            raise ValueError(f"has {fewer} cells than headings in line {number}")
    return {number: row[column] for number, row in rows.items()}


def _check_unit(of: str, unit: str, what: str) -> None:
    try:
        unit_in(of, unit)
    except ValueError:
        raise ValueError(f"must have a unit of {what} in their heading, {EXAMPLE}, not {unit}") from None


def _numbers(cells: Mapping[int, str]) -> list[float]:
    """The numbers of a column, all with decimal points or all with decimal commas."""
    marked = {mark: {number: cell for number, cell in cells.items() if mark in cell} for mark in ",."}
    with_commas, with_points = marked[","], marked["."]
    beside = with_commas or any(re.fullmatch(r"[-+]?\d{3}", cell) for cell in cells.values())  # 950 beside 1.000
    if with_commas and all(THOUSANDS.fullmatch(cell) for cell in with_commas.values()):
        number, cell = next(iter(with_commas.items()))
        raise ValueError(f"has {cell!r} in line {number}: write thousands without a comma, or decimals with a point")
    if with_points and beside and all(THOUSANDS.fullmatch(cell) for cell in with_points.values()):
        number, cell = next(iter(with_points.items()))
        raise ValueError(f"has {cell!r} in line {number}, whose point may mark thousands: write these without a mark")
    found = []
    for number, cell in cells.items():
        value = NOT_A_NUMBER
        with suppress(ValueError):
            value = float(cell.replace(",", ".") if with_commas else cell)
        if not isfinite(value):
            raise ValueError(f"must have a number, not {cell!r}, in line {number}")
        found.append(value)
    return found


def _check_order(times: Sequence[float], cells: Mapping[int, str]) -> None:
    """Raise a ValueError if times step back; the same time twice stands for a jump of the flow."""
    written = list(cells.items())
    for k in range(1, len(times)):
        if times[k] < times[k - 1]:
            (_, before), (number, here) = written[k - 1 : k + 1]
            raise ValueError(f"must have ascending times, but steps back from {before} to {here} in line {number}")


def _durations(cells: Mapping[int, str], form: str) -> list[float]:
    """Seconds by texts such as 00:30 in a column whose heading has their form, such as mm:ss."""
    sizes = [SECONDS[part[0]] for part in form.lower().split(":")]
    found = []
    for number, cell in cells.items():
        parts = cell.replace(",", ".").split(":")
        try:
            found.append(sum(size * float(part) for size, part in zip(sizes, parts, strict=True)))
        except ValueError:
            raise ValueError(f"must have times such as {form}, not {cell!r}, in line {number}") from None
    return found


def _clock(cells: Mapping[int, str]) -> list[float]:
    """Seconds since the first of the dates or times of day in a column."""
    texts = list(cells.values())
    if all(re.fullmatch(r"[-+.,\d]+", cell) for cell in texts):
        raise ValueError(f"must have the unit of its times in their heading, {EXAMPLE}")
    if all(re.fullmatch(SHORT_TIME, cell) for cell in texts):
        form = "write which into the heading, as in time [mm:ss] or time [hh:mm]"
        raise ValueError(f"has times such as {texts[0]}, of hours and minutes or minutes and seconds: {form}")
    orders = [False]  # whether the day is before the month
    if all(re.fullmatch(DAY_OR_MONTH, cell) for cell in texts):
        orders = [True] if all("." in cell.split()[0] for cell in texts) else [False, True]
    readings = [times for day_first in orders if (times := _seconds(texts, day_first))]
    if not readings:
        raise ValueError(f"must have the unit of its times in their heading, {EXAMPLE}, or a {DATES}")
    ascending = [times for times in readings if times == sorted(times)] or readings[:1]
    if ascending[0] != ascending[-1]:
        raise ValueError(f"has dates such as {texts[0]}, which may begin with day or month: write them as 2026-12-31")
    return ascending[0]


def _seconds(texts: Sequence[str], day_first: bool) -> list[float]:
    """Seconds since the first of some dates or times of day; empty if they are none."""
    try:
        times = pd.to_datetime(pd.Series(texts), format="mixed", dayfirst=day_first)
    except ValueError:
        return []
    return [float(each) for each in (times - times.iloc[0]).dt.total_seconds()]

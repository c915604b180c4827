"""Reads times and flow rates from the log of a pump: a table with headings, which have the units."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path

import pandas as pd

from pairsim.cases.quantity_text import unit_in
from pairsim.cases.values import MOST_VALUES

TIMES = re.compile(r"(elapsed|run|pump)?\W?(t|time|times|zeit|temps|tiempo|tempo|time ?stamps?|date ?time)", re.I)
FLOWS = re.compile(
    r"(measured|actual|pump(ed)?|volum\w*|mean|set)?\W?(q|flow\W?rates?|flow|rate|fluss(rate)?|flussrate|"
    r"volumenstrom|d[ée]bit|caudal|portata)(\W?(q|measured|actual|set))?",
    re.I,
)
HEADING = re.compile(r"(?P<name>[^\[\](){}]*?)\W*(?:[\[({/,]|\bin\b)\s*(?P<unit>[^\])}]+?)\s*[\])}]?\s*")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+")  # ambiguous: 1,000 may also have three decimals
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
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    start, separator, columns = _heading(lines)
    width = len(_row(lines[start], separator))
    rows = {
        number: _row(line, separator)
        for number, line in enumerate(lines[start + 1 :], start + 2)
        if line.strip(separator + " ")
    }
    if len(rows) > MOST_VALUES:
        raise ValueError(f"must have at most {MOST_VALUES:,} times, not {len(rows):,}: leave some out")
    cells = {name: _cells(rows, i, width) for name, (i, _) in columns.items()}
    time_unit, flow_unit = columns["time"][1], columns["flow"][1]
    if time_unit:
        unit_in("s", time_unit)
        times = _numbers(cells["time"])
    else:
        times, time_unit = _clock(cells["time"]), "s"
    _check_order(times, cells["time"])
    if not flow_unit:
        raise ValueError(f"must have the unit of its flow rates in their heading, {EXAMPLE}")
    unit_in("m^3/s", flow_unit)
    flows = _numbers(cells["flow"])
    return [f"{t:.12g} {time_unit}" for t in times], [f"{q:.12g} {flow_unit}" for q in flows]


def _heading(lines: Sequence[str]) -> tuple[int, str, dict[str, tuple[int, str]]]:
    """The index of the line of headings, its separator, and for "time" and "flow" the index and unit of the column."""
    for i, line in enumerate(lines):
        for separator in SEPARATORS:
            found: dict[str, tuple[int, str]] = {}
            for k, text in enumerate(_row(line, separator)):
                match = HEADING.fullmatch(text)
                name, unit = (match["name"].strip(), match["unit"]) if match else (text, "")
                for what, names in (("time", TIMES), ("flow", FLOWS)):
                    if names.fullmatch(name.replace("_", " ").strip()) and what not in found:
                        found[what] = k, _unit(unit)
            if len(found) == 2:
                return i, separator, found
    raise ValueError(f"must have a line of headings, {EXAMPLE}, with one time and one flow rate")


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


def _numbers(cells: Mapping[int, str]) -> list[float]:
    """The numbers of a column, all with decimal points or all with decimal commas."""
    with_commas = {number: cell for number, cell in cells.items() if "," in cell}
    if with_commas and all(THOUSANDS.fullmatch(cell) for cell in with_commas.values()):
        number, cell = next(iter(with_commas.items()))
        raise ValueError(f"has {cell!r} in line {number}: write thousands without a comma, or decimals with a point")
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


def _clock(cells: Mapping[int, str]) -> list[float]:
    """Seconds since the first of the dates or times of day in a column."""
    texts = list(cells.values())
    try:
        times = pd.to_datetime(pd.Series(texts), format="mixed")
    except ValueError:
        raise ValueError(f"must have the unit of its times in their heading, {EXAMPLE}, or a {DATES}") from None
    if all(re.fullmatch(r"[-+.,\d]+", cell) for cell in texts):
        raise ValueError(f"must have the unit of its times in their heading, {EXAMPLE}")
    seconds = (times - times.iloc[0]).dt.total_seconds()
    return [float(each) for each in seconds]

"""Times and flow rates of a file as a pump logs them: a table with headings, which have the units."""

from __future__ import annotations

import re
from collections.abc import Sequence
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
SEPARATORS = "\t;,"
DATES = "date or time of day"
EXAMPLE = "such as time [s], flow rate [ul/min]"
SPELLED = {"µ": "u", "μ": "u", "minute": "min", "minutes": "min", "seconds": "s", "sec": "s"}


def read_pump_log(path: Path) -> tuple[list[str], list[str]]:
    """The times and flow rates of a file, each with its unit.

    Raises:
        ValueError: It has no such columns, a unit is missing or unknown, or a cell is no number.
        OSError: It cannot be read.
    """
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    start, separator, columns = _heading(lines)
    decimal = "," if separator != "," and any(re.search(r"\d,\d", line) for line in lines[start + 1 :]) else "."
    rows = [line.split(separator) for line in lines[start + 1 :] if line.strip(separator + " ")]
    if len(rows) > MOST_VALUES:
        raise ValueError(f"has {len(rows):,} times, of at most {MOST_VALUES:,}: leave out some")
    cells = {name: _cells(rows, i) for name, (i, _) in columns.items()}
    time_unit, flow_unit = columns["time"][1], columns["flow"][1]
    if time_unit:
        unit_in("s", time_unit)
        times = _numbers(cells["time"], decimal, start)
    else:
        times, time_unit = _clock(cells["time"]), "s"
    if not flow_unit:
        raise ValueError(f"must have the unit of the flow rates in their heading, {EXAMPLE}")
    unit_in("m^3/s", flow_unit)
    flows = _numbers(cells["flow"], decimal, start)
    return [f"{t:.12g} {time_unit}" for t in times], [f"{q:.12g} {flow_unit}" for q in flows]


def _heading(lines: Sequence[str]) -> tuple[int, str, dict[str, tuple[int, str]]]:
    """The place of the line of headings, what separates its cells, and the place and unit of each column."""
    for i, line in enumerate(lines):
        for separator in SEPARATORS:
            found: dict[str, tuple[int, str]] = {}
            for k, cell in enumerate(line.split(separator)):
                text = cell.strip(" \"'")
                match = HEADING.fullmatch(text)
                name, unit = (match["name"].strip(), match["unit"]) if match else (text, "")
                for what, names in (("time", TIMES), ("flow", FLOWS)):
                    if names.fullmatch(name.replace("_", " ").strip()) and what not in found:
                        found[what] = k, _unit(unit)
            if len(found) == 2:
                return i, separator, found
    raise ValueError(f"must have a line of headings, {EXAMPLE}, with one time and one flow rate")


def _unit(text: str) -> str:
    for sign, other in SPELLED.items():
        text = re.sub(rf"\b{sign}\b" if sign.isascii() else sign, other, text)
    return re.sub(r"\s*/\s*", "/", text.strip()).replace("/s.", "/s")


def _cells(rows: Sequence[Sequence[str]], column: int) -> list[str]:
    short = next((i for i, row in enumerate(rows) if len(row) <= column), None)
    if short is not None:
        raise ValueError(f"has fewer columns than headings in row {short + 1} below them")
    return [row[column].strip(" \"'") for row in rows]


def _numbers(cells: Sequence[str], decimal: str, start: int) -> list[float]:
    found = []
    for i, cell in enumerate(cells):
        try:
            found.append(float(cell.replace(",", ".") if decimal == "," else cell))
        except ValueError:
            raise ValueError(f"must have a number, not {cell!r}, in line {start + 2 + i}") from None
    return found


def _clock(cells: Sequence[str]) -> list[float]:
    """Seconds since the first of some dates or times of day."""
    try:
        times = pd.to_datetime(pd.Series(cells), format="mixed")
    except ValueError:
        raise ValueError(f"must have the unit of its times in their heading, {EXAMPLE}, or a {DATES}") from None
    if all(re.fullmatch(r"[-+.,\d]+", cell) for cell in cells):
        raise ValueError(f"must have the unit of its times in their heading, {EXAMPLE}")
    seconds = (times - times.iloc[0]).dt.total_seconds()
    return [float(each) for each in seconds]

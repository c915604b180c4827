"""Tables in the text of a file: each below a line of headings, with a name, and rows that fit the headings."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product, zip_longest
from typing import NamedTuple

import numpy as np
import pandas as pd

from pairsim.lab.rheometer.column_headings import Column, column, places, spellings
from pairsim.lab.rheometer.number_formats import NUMBER, Marks, marks_of, numbers_in
from pairsim.runtime.arrays import Array
from pairsim.runtime.text import counted

SPACES = r"\t|\s{2,}"
ONE_SPACE = r"\s+(?![^\[(]*[\])])"
SEPARATORS = ("\t", ";", ",", SPACES, ONE_SPACE)
STEP_COLUMNS = r"(?i)action name|step name|interval|segment"
TITLES = r"(?im)^(?:\[step\]\n(?!step name)|(?:step name|result|résultat|ergebnis)\b:?[\t;,])(.+)"
INTERVALS = r"(?im)^interval\w*\b[^\t;,]*[\t;,](\d+)"
COLUMNS: Mapping[str, Sequence[tuple[str, ...]]] = {
    "rheology": [("rate", "viscosity"), ("rate", "stress")],
    "spectrum": [
        ("frequency", "storage", "loss"),
        *product(["frequency"], ["complex modulus", "storage", "loss", "complex viscosity"], ["factor", "phase"]),
    ],
}
"""The sets of columns each of which suffices for a kind of file, the preferred ones first."""
FEWEST = 5
RIGHT_ANGLE = 90.0  # [degrees]
Places = dict[str, tuple[int, str]]  # by quantity, the place of its column, and the text of its heading after the name


@dataclass(frozen=True)
class Section:
    """A table of a file, or those rows of it that belong to one step."""

    name: str  # its name, or where it is in the file
    line: int  # of its headings, from 1
    heading: list[str]  # the cells of this line
    places: Places  # the quantities that are read, rates first
    further: Places  # others, by which it is checked
    near: pd.DataFrame  # rows above and below the headings, which may have units
    cells: pd.DataFrame  # the rows by the number of their line
    marks: Marks  # of its numbers
    beside: frozenset[int] = frozenset()  # places of columns with the same headings that belong to other sections
    misfit: str = ""  # why a row, or every row, does not fit the headings
    foreign: bool = False  # whether no row fits them
    aside: str = ""  # a description of rows below it that are not measured points of it

    def numbers_of(self, quantity: str) -> pd.Series[float]:
        """A column in its unit, NaN where there is no number, (rows,).

        Raises:
            ValueError: Its marks may separate thousands.
        """
        place, _ = (self.places | self.further)[quantity]
        return numbers_in(self.cells[place], self.marks)

    @cached_property
    def numbers(self) -> pd.DataFrame:
        """The columns that are read, by quantity; ValueError as for `numbers_of`."""
        return pd.DataFrame({name: self.numbers_of(name) for name in self.places}, self.cells.index)

    @cached_property
    def usable(self) -> pd.Series[bool]:
        """Whether a row has positive numbers in all columns but that of N1, and a phase below 90 degrees.

        Raises:
            ValueError: As for `numbers`, or the unit of the phase is not understood.
        """
        return self.measured.all(axis=1)

    @cached_property
    def measured(self) -> pd.DataFrame:
        """For each column that is read but N1, whether its numbers can be those of a liquid; errors as for `usable`."""
        possible = self.numbers.drop(columns="N1", errors="ignore") > 0
        if "phase" in possible:  # beyond a right angle G' is negative: what turns is the inertia of the instrument
            possible["phase"] &= self.numbers["phase"] * self.column("phase").factor < RIGHT_ANGLE
        return possible

    @cached_property
    def columns(self) -> dict[str, Column]:
        """The columns that are read with their units, by quantity; ValueError if a unit is not understood."""
        return {name: self.column(name) for name in self.places}

    def column(self, quantity: str) -> Column:
        """A column with its unit; ValueError if this is not understood."""
        place, rest = (self.places | self.further)[quantity]
        beside = [*self.cells[place + 1].unique()] if place + 1 in self.cells else []
        of_next = [] if any(re.fullmatch(NUMBER, cell) for cell in beside) else [" ".join(beside)]
        return column(quantity, place, self.heading[place], rest, [*self.near[place], *of_next])

    @property
    def of_columns(self) -> str:
        """The numbers of its columns, counted from 1, in words."""
        return f"columns {' and '.join(str(i + 1) for i in sorted(i for i, _ in self.places.values()))}"

    @property
    def span(self) -> float:
        """The logarithm of the largest over the least rate; 0 if too few rows are usable."""
        rates = self.numbers.iloc[:, 0][self.usable]
        return float(np.log(rates.max() / rates.min())) if len(rates) >= FEWEST else 0.0

    def si(self, columns: Mapping[str, Column] | None = None) -> dict[str, Array]:
        """The values of its usable rows, by quantity in SI units, (rows,) each."""
        usable = self.numbers[self.usable]
        return {name: usable[name].to_numpy() * each.factor for name, each in (columns or self.columns).items()}


def cells_of(line: str, separator: str) -> list[str]:
    """The cells of a line, split at blanks if it does not have the separator."""
    if len(separator) == 1 and separator in line:
        cells = next(csv.reader([line], delimiter=separator))
    else:  # a row of numbers alone, which has no blanks within a cell
        words = re.search(r"[^\W\d_eEdD]", line)
        cells = re.split((SPACES if len(separator) == 1 else separator) if words else r"\s+", line.strip())
    return [cell.replace("_", " ").replace('"', "''").strip() for cell in cells]


def table_of(rows: Mapping[int, Sequence[str]]) -> pd.DataFrame:
    """Rows as a table, by the numbers of their lines; cells that a shorter row lacks are empty."""
    columns = zip_longest(*rows.values(), fillvalue="")
    return pd.DataFrame(dict(enumerate(columns)), index=list(rows), dtype=str)


def heading_of(kind: str, line: str) -> tuple[str, list[str], Places] | None:
    """The separator of a line of headings, its cells, and the columns of a kind of file; None if it has no headings."""
    separators = SEPARATORS[:-1] if re.search(r"[\t;,]", line) else SEPARATORS
    for separator in separators if re.search(r"[^\W\d_]", line) else ():
        cells = cells_of(line, separator)
        if len(cells) > 1 and (found := _places(kind, cells)):
            return separator, cells, found
    return None


def _places(kind: str, row: Sequence[str]) -> Places:
    """The columns that are read below a row; empty if it is no line of headings."""
    if sum(cell[:1].isdigit() for cell in row) > 1:
        return {}
    named = {name: next(iter(each.items())) for name, each in places(kind, row).items()}
    for names in COLUMNS[kind]:
        found = {name: named[name] for name in names if name in named}
        if len({i for i, _ in found.values()}) == len(names):
            return found | {name: named[name] for name in ("N1",) if name in named}
    return {}


def sections_of(kind: str, lines: Sequence[str], leading: bool = False) -> list[Section]:
    """All tables with the columns of a kind of file, split by the steps that their rows name.

    With `leading`, rows may lack the last columns of the headings.
    """
    heads = {i: found for i, line in enumerate(lines) if (found := heading_of(kind, line))}
    repeated = [i for k, i in pairwise(heads) if lines[i] == lines[k] and re.match(r'[\s"]*[-+.\d]', lines[i - 1])]
    heads = {i: found for i, found in heads.items() if i not in repeated}  # as at the top of each printed page
    names = _Names(lines)
    bounds = [*heads, len(lines)]
    sections = [
        each
        for before, start, end in zip([0, *bounds], bounds, bounds[1:], strict=False)
        for each in _of_table(kind, lines, start, end, heads[start], names.of(before, start), leading)
    ]
    for more in (lambda each: f" below line {each.line}", lambda each: f", {each.of_columns}"):
        counts = Counter(each.name for each in sections)
        sections = [replace(each, name=each.name + more(each)) if counts[each.name] > 1 else each for each in sections]
    return sections


def _of_table(
    kind: str,
    lines: Sequence[str],
    start: int,
    end: int,
    head: tuple[str, list[str], Places],
    title: str,
    leading: bool,
) -> Iterator[Section]:
    """The sections of the table whose headings are line `start`, from 0, and whose rows end before line `end`."""
    separator, raw, read = head
    heading = raw[: max(i for i, cell in enumerate(raw) if cell) + 1]
    used = [i for i in range(start + 1, end) if lines[i].strip(' \t;,"') and lines[i] != lines[start]]
    rows = {i + 1: cells_of(lines[i], separator) for i in used}
    named_block = heading[0].endswith(":")  # of RheoCompass; rows begin with a blank below it, or with their numbers
    if named_block:
        rows = {line: ["", *row] if row[0][:1].isdigit() else row for line, row in rows.items()}
    rows = {line: _split_again(lines[line - 1], row, len(heading)) for line, row in rows.items()}
    rows, aside = _without_others(rows, max(len(raw), len(heading)), len(heading))
    rows, summary = _without_summary(rows)
    cells = table_of({start + 1: heading} | rows).drop(index=start + 1)
    marks, doubt = marks_of([cell for row in rows.values() for cell in row], separator)
    plain = {i: cells[i].str.fullmatch(rf"{NUMBER}|{marks.thousands}") for i, _ in read.values()}
    text = pd.Series([_is_text(row) for row in rows.values()], cells.index, dtype=bool)
    measured = pd.DataFrame(plain, cells.index).any(axis=1) & ~text
    first = measured.idxmax() if measured.any() else end + 1
    below = (cells[[i for i, _ in read.values()]] != "").any(axis=1) & (cells.index < first)
    last = max(cells.index[below], default=start)
    follows = measured.shift(-1, fill_value=False)
    names = text & follows & (cells.index > last)
    ends = text & ~follows & (cells.index > first)
    step = _step(heading, cells).where(~names, [" ".join(row).strip() for row in rows.values()]).ffill().fillna("")
    above = [cells_of(lines[start - 1], separator)] if start else []
    near = pd.concat([cells[below], pd.DataFrame(above)]).fillna("")
    parts = _side_by_side(kind, heading, read)
    outside = "; ".join(filter(None, (summary, aside)))
    for of_step, mine in cells[~text & ~ends.cummax() & (cells.index > last)].groupby(step, sort=False):
        own = {line: rows[line] for line in mine.index}
        misfit, foreign = _misfit(own, start + 1, len(heading), len(raw), named_block or leading)
        for part in parts:
            sample = _sample_above(above[0] if above else [], part, parts) if len(parts) > 1 else ""
            name = ", ".join(filter(None, (title, str(of_step), sample)))
            name = f"section '{name}'" if name else f"the table below line {start + 1}"
            read, further, beside = part
            yield Section(
                name, start + 1, heading, read, further, near, mine, marks, beside, misfit or doubt, foreign, outside
            )


class _Part(NamedTuple):
    """The columns of one of several tables that stand side by side."""

    read: Places
    further: Places
    beside: frozenset[int]


def _side_by_side(kind: str, heading: Sequence[str], read: Places) -> list[_Part]:
    """The tables that stand side by side, with the same headings, and perhaps one column of rates for all."""
    named = places(kind, heading)
    alike = {
        name: [(i, rest) for i, rest in sorted(each.items()) if heading[i] == heading[next(iter(each))]]
        for name, each in named.items()
    }
    rate, *others = read
    count = len(alike[others[0]])
    if any(len(alike[name]) != count for name in others) or len(alike[rate]) not in (1, count):
        count = 1
    all_ = {i for name in read for i, _ in alike[name]} if count > 1 else set()
    parts = []
    for k in range(count):
        own = {name: each[k] if len(each) == count else each[0] for name, each in alike.items()}
        mine = {name: own[name] for name in read}
        further = {name: own[name] for name in named if name not in read and len(alike[name]) in (1, count)}
        parts.append(_Part(mine, further, frozenset(all_ - {i for i, _ in mine.values()})))
    return parts


def _sample_above(above: Sequence[str], part: _Part, parts: Sequence[_Part]) -> str:
    """The name that stands in the line above the headings of one of several tables, or else its columns."""
    all_ = [{i for i, _ in each.read.values()} for each in parts]
    mine, shared = {i for i, _ in part.read.values()}, set.intersection(*all_)
    before = max([*shared, *(max(each) for each in all_ if max(each) < max(mine))], default=-1)
    names = [cell for cell in above[before + 1 : max(mine) + 1] if re.match(r"[^\W\d_]", cell)]
    return names[0] if names else f"columns {' and '.join(str(i + 1) for i in sorted(mine))}"


def _split_again(line: str, row: list[str], names: int) -> list[str]:
    """A row; one of numbers alone that does not fit the headings is split at blanks and tabs if it then does."""
    if len(row) == names or not re.fullmatch(r"[-+\d.eEdD\s]*", line):
        return row
    again = line.split()
    return again if len(again) == names else row


def _is_text(row: Sequence[str]) -> bool:
    """Whether a row is a name, or begins another block."""
    filled = [cell for cell in row if cell]
    alone = len(filled) == 1 and re.match(r"\W*[^\W\d_]", filled[0])
    return filled[0].startswith("[") or filled[0].endswith(":") or bool(alone)


def _is_data(row: Sequence[str]) -> bool:
    """Whether a row has several numbers, or numbers alone."""
    filled = [cell for cell in row if cell]
    numbers = sum(bool(re.fullmatch(NUMBER, cell)) for cell in filled)
    return not _is_text(row) and (numbers > 1 or numbers == len(filled))


def _filled(row: Sequence[str]) -> int:
    return max((i + 1 for i, cell in enumerate(row) if cell), default=0)


def _without_others(rows: dict[int, list[str]], most: int, names: int) -> tuple[dict[int, list[str]], str]:
    """The rows before a block that does not fit the headings, below an empty line, and what that block is, in words.

    The words are empty without such a block.

    Args:
        rows: Cells by the number of the line.
        most: Largest number of cells that may be filled.
        names: Number of headings.
    """

    def fits(row: Sequence[str]) -> bool:
        return names <= len(row) and _filled(row) <= most

    data = {line: row for line, row in rows.items() if _is_data(row)}
    starts = [line for before, line in pairwise(data) if line - before > 1 and line - 1 not in rows]
    for i, line in enumerate(starts):
        block = [row for at, row in data.items() if line <= at < (*starts[i + 1 :], np.inf)[0]]
        before = [row for at, row in data.items() if at < line]
        several = len(block) > 1 or len(block[0]) == 1
        if several and any(map(fits, before)) and not any(map(fits, block)):
            count = f"{counted(_filled(block[0]), 'cell')} instead of {names}"
            return {at: row for at, row in rows.items() if at < line}, f"what is below line {line - 1}, with {count}"
    return rows, ""


def _without_summary(rows: dict[int, list[str]]) -> tuple[dict[int, list[str]], str]:
    """The rows before those at the end that are means, deviations or limits of them, and what these are, in words."""
    summary: dict[int, str] = {}
    for line, row in reversed(rows.items()):
        name = next(filter(None, row), "")
        if not re.fullmatch(spellings().summary, name) or not any(re.fullmatch(NUMBER, cell) for cell in row):
            break
        summary[line] = name
    if not summary:
        return rows, ""
    line, name = min(summary.items())
    words = f"{counted(len(summary), 'row')} from line {line} on, such as {name}, of a summary"
    return {at: row for at, row in rows.items() if at not in summary}, words


def _misfit(rows: Mapping[int, Sequence[str]], line: int, names: int, raw: int, leading: bool) -> tuple[str, bool]:
    """What is wrong with the first row that does not fit the headings ("" if all do), and whether no row fits them.

    Cells may be missing at the end of a row if other rows never have numbers there or, with `leading`, if all rows are
    equally short. Elsewhere it is not known which cell is missing.
    """
    data = {at: row for at, row in rows.items() if _is_data(row)}
    full = [row for row in data.values() if len(row) >= names]
    measured = {i for row in full for i, cell in enumerate(row) if re.fullmatch(NUMBER, cell)}
    trimmed = leading and len({len(row) for row in data.values()}) == 1
    wrong = {}
    for at, row in data.items():
        count = f"line {at} has {counted(max(_filled(row), len(row)), 'cell')}, the headings (line {line}) {names}"
        if _filled(row) > max(names, raw):
            wrong[at] = (
                f"must have a heading over each column, and not commas both in numbers and between them: {count}"
            )
        elif len(row) < names and not trimmed and not (full and measured.isdisjoint(range(len(row), names))):
            wrong[at] = f"must have a cell below each heading, empty where nothing was measured: {count}"
    return next(iter(wrong.values()), ""), bool(wrong) and len(wrong) == len(data)


def _step(heading: Sequence[str], cells: pd.DataFrame) -> pd.Series[str]:
    """The steps that rows name: in a column of its own (rSpace), or before the number of the point (RheoWin)."""
    for i, name in enumerate(heading):
        if re.fullmatch(STEP_COLUMNS, name):
            return cells[i].where(cells[i] != "")
    return "step " + cells[0].str.extract(r"^(\d+)\|\d+$", expand=False)


class _Names:
    """The names that stand before the tables of a file."""

    def __init__(self, lines: Sequence[str]) -> None:
        self._lines = lines
        samples = re.findall(spellings().samples, "\n".join(lines))
        self._kinds = [spellings().tests] + ([spellings().samples] if len(set(samples)) > 1 else [])

    def of(self, before: int, start: int) -> str:
        """The name of the table with headings in line `start`, where those of the one before are in line `before`."""
        above, since = "\n".join(self._lines[:start]), "\n".join(self._lines[before:start])
        titles, intervals = re.findall(TITLES, above), re.findall(INTERVALS, above)
        title = titles[-1:] if titles and re.search(TITLES, since) else self._line_above(before, start) or titles[-1:]
        tests = [found[-1] for kind in self._kinds if (found := re.findall(kind, above))]
        names = [each.strip(" \t;,") for each in (*tests, *title)]
        return ", ".join([*dict.fromkeys(names)] + [f"interval {i}" for i in intervals[-1:]])

    def _line_above(self, before: int, start: int) -> list[str]:
        """The last line of words alone between two tables."""
        for line in reversed(self._lines[before:start]):
            words_alone = re.fullmatch(r"[\W_]*([^\W\d_][^\t;,=:]*?)[\W_]*", line)
            if re.match(rf"\s*{NUMBER.removeprefix('(?i)')}[\t;,\s]", line):
                break
            if words_alone:
                return [words_alone[1]]
        return []

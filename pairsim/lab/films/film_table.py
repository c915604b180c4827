"""The table of a film: which of its columns are times, frames, particles, positions and distances, and their units.

Each tracker and spreadsheet writes them in its own way. Made after tables of TrackPy, TrackMate (four lines of
headings), ImageJ and its plugins Manual Tracking, MTrack2 and MOSAIC.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from pairsim.cases.quantity_text import unit_in
from pairsim.lab.films.headings import CENTRES, FRAME, HEADINGS, PARTICLE, SURFACES, TIME, Heading, X, Y
from pairsim.lab.rheometer.export_files import text_of
from pairsim.lab.rheometer.export_tables import ONE_SPACE, SEPARATORS, cells_of, table_of
from pairsim.lab.rheometer.number_formats import HUGE, NUMBER, marks_of
from pairsim.runtime.errors import InputError

_ONE = r"\d+|[a-z]|lead\w*|trail\w*|left|right|front|rear"
SEVERAL = rf"(?P<axis>[xy]) ?(?P<name>{_ONE})|(?P<first>.*\d|(.+ )?({_ONE}) ) ?(?P<last>[xy])"
CAPITAL_D = "capital d"
UNCLEAR = rf"dist(ance)?s?|separation|spacing|abstand|{CAPITAL_D}"
GAPS = {"", "nan", "na", "n/a", "#n/a", "none", "null", "-", "--", "#div/0!", "#value!", "#num!"}
PIXELS, FRAMES = r"px|pix|pixels?", r"fr|frames?|slices?"
EXAMPLE = "such as t [s], d [um], or frame, particle, x, y"
MOST_NAMED = 12  # largest number of headings that a message names


@dataclass(frozen=True)
class Column:
    """A column of a film.

    Attributes:
        heading: Its heading.
        cells: Its cells, by the number of their line.
        numbers: The cells as numbers in the unit of the file, NaN where one is empty, or is a name.
        unit: The unit that the file gives, "px" or "frame"; "" without one.
        size: This unit in SI units; NaN for "px" and "frame", and without a unit.
    """

    heading: str
    cells: pd.Series[str]
    numbers: pd.Series[float]
    unit: str = ""
    size: float = np.nan


@dataclass(frozen=True)
class FilmTable:
    """A table of a film.

    Attributes:
        path: Its file.
        columns: Columns by their kind.
        particles: Columns of `X` and, if there are any, `Y` of particles that have columns of their own, by their
            names.
        below: The first line with numbers below the end of the table, which are not read; 0 without any.
    """

    path: Path
    columns: Mapping[Heading, Column]
    particles: Mapping[str, Mapping[Heading, Column]]
    below: int = 0

    @property
    def tracked(self) -> bool:
        """Whether it has positions of particles, in place of distances."""
        return bool(self.particles) or X in self.columns

    @property
    def clock(self) -> Column:
        """The column that tells frames apart: that of their numbers, or else of times."""
        return self.columns.get(FRAME) or self.columns[TIME]

    @property
    def placed(self) -> Sequence[Mapping[Heading, Column]]:
        """Columns of positions or distances: those of each particle, or of all of them together."""
        return list(self.particles.values()) or [self.columns]

    def error(self, key: str, value: object, allowed: str, line: int | None = None) -> InputError:
        """An error in the file."""
        return InputError(str(self.path), key, value, allowed, line=line)


def read_film_table(path: Path) -> FilmTable:
    """Read the table of a film.

    Raises:
        InputError: The file has no such table, or a cell, row or unit of it is wrong.
    """
    if not path.exists():
        raise InputError(str(path), "", None, "no such file")
    try:
        lines = text_of(path).split("\n")
        start, separator, heading = _heading(lines)
        rows = {i + 1: _split(lines[i], separator) for i in _body(lines, start)}
        places, particles = _places(heading)
        used = [i for what, several in places.items() if what is not PARTICLE for i in several]
        used += [i for each in particles.values() for i in each.values()]
        decimal = _decimal([row[i] for row in rows.values() for i in used if i < len(row)], separator)
    except ValueError as error:
        raise InputError(str(path), "", None, str(error)) from None
    if not places.keys() & {X, SURFACES, CENTRES} and not particles:
        raise _unnamed(path, heading)
    table = table_of({start + 1: heading} | rows).drop(index=start + 1)
    measured = table[used].apply(lambda cells: cells.str.fullmatch(NUMBER)).any(axis=1)
    if not measured.any():
        raise InputError(str(path), heading[used[0]], None, "must have numbers below it")
    first = measured.idxmax()
    above, table = table[table.index < first], table[table.index >= first]
    _check_cells(path, start + 1, heading, {line: row for line, row in rows.items() if line >= first}, max(used))

    def column(i: int, what: Heading) -> Column:
        numbers = _numbers(table[i], decimal)
        wrong = table[i][numbers.isna() & ~table[i].str.lower().isin(GAPS)]
        if len(wrong) and what is not PARTICLE:
            raise InputError(str(path), heading[i], wrong.iloc[0], "must be a number", line=int(wrong.index[0]))
        try:
            return Column(heading[i], table[i], numbers, *_unit(what, heading[i], [*above[i]]))
        except ValueError as error:
            raise InputError(str(path), heading[i], None, str(error)) from None

    def taken(what: Heading, several: Sequence[int]) -> Column:
        if len({tuple(table[i]) for i in several}) > 1:  # t [s] and T [degC] have one name
            several = [i for i in several if _size(what.unit, _parts(heading[i])[1])] or several
        if len({tuple(table[i]) for i in several}) > 1:
            raise InputError(str(path), heading[several[0]], None, "must be the heading of one column, not of several")
        return column(several[0], what)

    columns = {what: taken(what, several) for what, several in places.items()}
    units = [i for i, each in enumerate(heading) if re.fullmatch("units?", _name(each))]
    if units and len(of_all := table[units[0]].unique()) == 1:  # in a column of its own
        for what in {X, Y} & columns.keys():
            if not columns[what].unit:
                unit, size = _unit(what, f"{columns[what].heading} [{of_all[0]}]", [])
                columns[what] = replace(columns[what], unit=unit, size=size)
    of_one = {name: {axis: column(i, axis) for axis, i in each.items()} for name, each in particles.items()}
    return FilmTable(path, columns, of_one, _numbers_below(lines, max(rows), separator))


def _heading(lines: Sequence[str]) -> tuple[int, str, list[str]]:
    """Place of the line of headings, the separator of its cells, and the cells; ValueError if there is none."""
    if lines[0].lstrip().startswith("<"):
        raise ValueError("must be a table, but is XML: export the spots as CSV")
    said = re.fullmatch(r'"?sep=(.)"?[\s,;]*', lines[0])
    for i, line in enumerate(lines):
        separators = SEPARATORS[:-1] if re.search(r"[\t;,]", line) else SEPARATORS
        for separator in [said[1]] if said else separators if re.search(r"[^\W\d_]", line) else ():
            cells = _split(re.sub(r"\s+(?=[\[(])", "", line) if separator == ONE_SPACE else line, separator)
            if sum(cell[:1].isdigit() for cell in cells) > 1:
                continue
            places, particles = _places(cells)
            unclear = any(re.fullmatch(UNCLEAR, _name(cell)) for cell in cells)
            if places.keys() & {TIME, FRAME} and (places.keys() & {X, SURFACES, CENTRES} or particles or unclear):
                filled = max(k for k, cell in enumerate(cells) if cell) + 1
                return i, separator, cells[:filled]
    rows = [_split(line, separator) for separator in SEPARATORS[:-1] for line in lines[:50]]
    named = max(rows, key=lambda row: sum(cell[:1].isalpha() for cell in row), default=[])
    has = ", ".join([each for each in named if each][:MOST_NAMED])
    raise ValueError(f"must be a table with headings, {EXAMPLE}, but has {has or 'nothing'}")


def _split(line: str, separator: str) -> list[str]:
    """The cells of a line, without quotation marks."""
    return [cell.strip("' ") for cell in cells_of(line, separator)]


def _body(lines: Sequence[str], start: int) -> Iterator[int]:
    """Places of the lines of a table, which ends at an empty line with no numbers below it."""
    for i in range(start + 1, len(lines)):
        if lines[i].strip(' \t;,"'):
            yield i
        elif not re.match(NUMBER, next(filter(None, (each.strip(' \t;,"') for each in lines[i:])), "")):
            return


def _numbers_below(lines: Sequence[str], last: int, separator: str) -> int:
    """The first line of numbers alone, two or more, below the last line of a table, counted from 1; 0 without any."""
    for line in range(last + 1, len(lines) + 1):
        cells = [cell for cell in _split(lines[line - 1], separator) if cell]
        if len(cells) > 1 and all(re.fullmatch(NUMBER, cell) for cell in cells):
            return line
    return 0


def _decimal(cells: Sequence[str], separator: str) -> str:
    """The decimal mark of a table; ValueError if its commas may be decimal or thousands marks."""
    marks, doubt = marks_of(cells, separator)
    if doubt and not any(re.fullmatch(r"\d{4,}", cell) for cell in cells):  # which would have a thousands mark, too
        raise ValueError(doubt)
    return marks.decimal


def _numbers(cells: pd.Series[str], decimal: str) -> pd.Series[float]:
    """Cells as numbers; NaN where there is none, or one above all measured values."""
    marks = str.maketrans({"." if decimal == "," else ",": "?", decimal: "."})  # with both marks it is no number
    numbers: pd.Series[float] = pd.to_numeric(cells.where(cells.str.fullmatch(NUMBER)).str.translate(marks), "coerce")
    return numbers.astype(float).where(numbers.abs() <= HUGE)


def _parts(heading: str) -> tuple[str, str]:
    """The name that a heading gives, and the unit, in brackets or after a comma, a stroke, "in" or a blank."""
    for pattern in (r"(.*?)\s*[\[(]([^\[\]()]*)[\])]", r"(.*?)\s*[,/]\s*(\S+)", r"(.+?) in (\S+)"):
        if match := re.fullmatch(pattern, heading.strip()):
            return match[1], match[2].strip()
    match = re.fullmatch(r"(.+) (\S+)", heading.strip())
    if match and (
        re.fullmatch(f"{PIXELS}|{FRAMES}", match[2], re.IGNORECASE) or _size("s", match[2]) or _size("m", match[2])
    ):
        return match[1], match[2]
    return heading, ""


def _name(heading: str) -> str:
    name = re.sub(r"[\s_.:-]+", " ", _parts(heading)[0]).strip()
    return CAPITAL_D if name == "D" else name.lower()  # D is mostly a diameter, d a distance


def _places(heading: Sequence[str]) -> tuple[dict[Heading, list[int]], dict[str, dict[Heading, int]]]:
    """Places of the columns that are needed, by their kind, and of columns of one particle each, by its name."""
    names = [_name(each) for each in heading]
    places: dict[Heading, list[int]] = {}
    for what in HEADINGS:
        for pattern in what.spellings:
            if what not in places and (found := [i for i, name in enumerate(names) if re.fullmatch(pattern, name)]):
                places[what] = [i for i in found if names[i] == names[found[0]]]
    if FRAME in places and TIME in places and all(_other_unit(TIME, heading[i]) for i in places[TIME]):
        del places[TIME]  # T is a temperature
    particles: dict[str, dict[Heading, int]] = {}
    taken = {i for each in places.values() for i in each}
    for i, name in enumerate(names):
        if i not in taken and (match := re.fullmatch(SEVERAL, name)):
            axis, particle = match["axis"] or match["last"], match["name"] or match["first"].strip()
            particles.setdefault(particle, {}).setdefault(X if axis == X.name else Y, i)
    particles = {name: each for name, each in particles.items() if X in each}
    of_one = {X, PARTICLE} <= places.keys() or {X, Y} <= places.keys()  # a row is of one particle: d is its diameter
    if of_one or (len(particles) < 2 and not places.keys() & {SURFACES, CENTRES}):
        wanted, particles = {PARTICLE, X, Y}, {}
    elif SURFACES in places or CENTRES in places:
        if len(particles) > 1:
            both = "positions of each particle and distances: remove the column of distances, or those of positions"
            raise ValueError(f"must not have {both}")
        wanted, particles = {SURFACES if SURFACES in places else CENTRES, PARTICLE}, {}
    else:
        wanted = {X, Y} if X in places else set()
        particles = {} if X in places else particles
    return {what: several for what, several in places.items() if what in wanted | {TIME, FRAME}}, particles


@cache
def _size(kind: str, unit: str) -> float | None:
    """The size of a unit in the SI unit `kind`; None if it is no unit of this dimension."""
    if not kind or not unit:
        return None
    unit = re.sub(r"\\u00b5|\\u03bc", "u", unit, flags=re.IGNORECASE)  # as Java writes a sign that is not in ASCII
    for spelled in (unit, unit.lower()) if len(unit) > 2 else (unit,):
        with suppress(ValueError):
            return unit_in(kind, spelled)
    return None


def _other_unit(what: Heading, heading: str) -> bool:
    """Whether the heading has a unit of another kind."""
    unit = _parts(heading)[1]
    known = FRAMES if what is TIME else PIXELS
    return bool(unit) and not re.fullmatch(known, unit, re.IGNORECASE) and _size(what.unit, unit) is None


def _unit(what: Heading, heading: str, above: Sequence[str]) -> tuple[str, float]:
    """The unit of a column, from its heading or a row below it, and its size.

    Raises:
        ValueError: The text in the place of the unit is no unit of this kind.
    """
    kind, unit, is_time = what.unit, _parts(heading)[1], what is TIME
    rows = [cell for cell in above if cell and _name(cell) != _name(heading)]
    for text in [unit, *rows] if kind else ():
        inside = text.strip("[]() ")
        if re.fullmatch(FRAMES if is_time else PIXELS, inside, re.IGNORECASE):
            return ("frame" if is_time else "px"), np.nan
        if inside and (size := _size(kind, inside)) is not None:
            return inside, size
        if inside and (text is unit or text != inside):
            raise ValueError(f"must have a unit such as {kind}, not {inside}")
    return "", np.nan


def _check_cells(path: Path, start: int, heading: list[str], rows: Mapping[int, list[str]], last: int) -> None:
    """Refuse rows with more or fewer cells than there are headings: their cells may belong to other columns."""
    whole = [row for row in rows.values() if len(row) >= len(heading)]
    for line, row in rows.items():
        filled = max((k for k, cell in enumerate(row) if cell), default=-1) + 1
        lacking = range(len(row), len(heading))
        shifted = lacking and len(row) > last and (not whole or any(each[i] for each in whole for i in lacking))
        if filled > len(heading) or shifted:
            wrong = f"has {max(filled, 1) if shifted else filled}, but line {start} has {len(heading)} headings"
            raise InputError(str(path), "", None, f"must have a cell for each heading: {wrong}", line=line)


def _unnamed(path: Path, heading: Sequence[str]) -> InputError:
    """The error of a table that does not say between what its distances are."""
    named = next(each for each in heading if re.fullmatch(UNCLEAR, _name(each)))
    return InputError(str(path), named, None, "must be headed d if it is between surfaces, c if it is between centres")

"""Flow curves and moduli in the text files that rheometers and spreadsheets write.

Such a file has one table or several, each below a line of headings, in an encoding and with separators and decimal
marks of its own. Tables are found by their headings, see `rheometer_columns`. Made after public files in
github.com/bsaintmichel/read-rheol (RheoCompass, rSpace, TRIOS), jorge-ramirez-upm/RepTate (.tts, .osc),
KarlClinckspoor/Rheology (RheoWin) and imewei/rheojax (TRIOS for LIMS, spreadsheets).
"""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from pairsim.api.rheometer_columns import Column, column, places
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

ENCODINGS = ["utf_8", "utf_16", "utf_16_le", "utf_16_be", "cp1252"]
SPREADSHEETS = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"  # first bytes of .xlsx, .ods and .xls
SEPARATORS = ("\t", ";", ",", r"\t|\s{2,}", r"\s+(?![^\[(]*[\])])")
ONE_SIGN = str.maketrans(
    dict.fromkeys("″“”", "''")
    | dict.fromkeys("’′´`‘", "'")  # noqa: RUF001
    | dict.fromkeys("−–‐", "-")  # noqa: RUF001
    | dict.fromkeys("·⋅∙•×", "*")  # noqa: RUF001
)
"""Quotation marks, primes, dashes and points of products, each in one way."""
NUMBER = r"[-+]?(\d+[.,]?\d*|[.,]\d+)(e[-+]?\d+)?"
REPTATE = "omega[rad/s]\tG'[Pa]\tG''[Pa]"
STEPS = "action name|step name|interval|segment"
TITLES = "step name|result|résultat|ergebnis"
NEEDED = {
    "--rheology": (2, "shear rate and viscosity or shear stress", "shear rate [1/s], viscosity [mPa.s]"),
    "--spectrum": (3, "frequency, storage modulus and loss modulus", "frequency [Hz], G' [Pa], G'' [Pa]"),
}
"""How many columns the file of an option needs, which, and an example of their headings."""
WORDS = {"stress": "viscosity from a stress", "storage": "G'", "loss": "G''"}
FEWEST = 5
LEAST_SPAN = 2.0  # largest over least rate: what is measured at about one rate is no curve; chosen
MOST_NAMED = 3  # other sections, or headings, that a sentence names


@dataclass(frozen=True)
class Section:
    """A table of a file, or those rows of it that belong to one step.

    Attributes:
        name: Its name, or where it is.
        heading: The cells of its line of headings.
        places: Place of the column of each quantity, and what its heading says after the name.
        below: Lines between headings and numbers.
        rows: Number of the line and cells of each row.
        numbers: The columns by quantity, rates first, in their units; NaN where there is no number.
    """

    name: str
    heading: list[str]
    places: dict[str, tuple[int, str]]
    below: list[list[str]]
    rows: list[tuple[int, list[str]]]
    numbers: pd.DataFrame

    @property
    def usable(self) -> pd.Series[bool]:
        """Whether a row has positive numbers in all columns but that of N1."""
        return (self.numbers.drop(columns="N1", errors="ignore") > 0).all(axis=1)

    @property
    def span(self) -> float:
        """The logarithm of the largest over the least rate."""
        rates = self.numbers.iloc[:, 0][self.usable]
        return float(np.log(rates.max() / rates.min())) if len(rates) else 0.0


def read_columns(option: str, file: Path, wanted: str | None = None) -> tuple[dict[str, Array], list[str]]:
    """The quantities that a file holds in SI units, and what was read and left out in sentences.

    Args:
        option: "--rheology" for rate, viscosity and N1, "--spectrum" for frequency, storage and loss.
        file: The file.
        wanted: A part of the name of the section to be read, None for the first one of those with the widest range.

    Raises:
        InputError: The file is no text, or has no table with these columns, or too few rows.
    """
    try:
        section, others = _section(option, _text(file), wanted)
        columns = {
            name: column(name, i, section.heading[i], rest, [row[i] for row in section.below])
            for name, (i, rest) in section.places.items()
        }
    except ValueError as error:
        raise InputError(str(file), option, file.name, str(error)) from None
    usable = section.numbers[section.usable]
    values = {name: usable[name].to_numpy() * each.factor for name, each in columns.items()}
    said = [_read(section, columns, values[usable.columns[0]]), *_left_out(option, section, columns)]
    if "stress" in values:
        values["viscosity"] = values.pop("stress") / values["rate"]
    if "N1" in values:
        said += _without_noise(values)
    if others:
        more = f" and {len(others) - MOST_NAMED} more" if len(others) > MOST_NAMED else ""
        said.append(f"not read: {'; '.join(others[:MOST_NAMED])}{more}; --section NAME reads another one")
    return values, [*(f"read: {file.name}: {sentence}" for sentence in said), *_assumed(file, columns)]


def _text(file: Path) -> str:
    from charset_normalizer import from_bytes

    try:
        content = file.read_bytes()
    except OSError as error:
        raise ValueError(f"must be a file that can be read ({error.strerror})") from None
    if content.startswith(SPREADSHEETS):
        raise ValueError("must be text: open it in a spreadsheet, and save the sheet with the table as CSV (UTF-8)")
    guesses = from_bytes(content, cp_isolation=ENCODINGS)  # UTF-8, where it can be, is seldom anything else
    decoded = next((each for each in guesses if each.encoding == "utf_8"), guesses.best())
    if decoded is None:
        raise ValueError("must be text: export the table as CSV or text from the software of the rheometer")
    text = str(decoded).removeprefix("\ufeff").translate(ONE_SIGN)
    text = unicodedata.normalize("NFKC", text).translate(ONE_SIGN)
    return re.sub(r"(?m)^#+[ \t]*(?=[^\W\d])", "", text)  # headings that begin with the sign of a comment


def _section(option: str, text: str, wanted: str | None) -> tuple[Section, list[str]]:
    """The section to be read, and the names of the others that could be."""
    if option == "--spectrum" and re.match(r"\w+=[^;\n]*;", text):  # RepTate: most of its files have no headings
        text = REPTATE + text[text.find("\n") :]
    sections: list[Section] = []
    for separator in SEPARATORS:
        found = [*_sections(option, _rows(text, separator), separator)]
        sections = max(sections, found, key=lambda each: max((section.usable.sum() for section in each), default=-1))
        if any(section.usable.sum() >= FEWEST for section in sections):
            break
    if not any(each.usable.any() for each in sections):
        raise ValueError(_no_table(option, text))
    wide = [each for each in sections if each.usable.sum() >= FEWEST and each.span >= np.log(LEAST_SPAN)]
    if not wide:
        most = max(each.usable.sum() for each in sections)
        rows = (
            f"at least {FEWEST} rows of positive numbers, with rates that differ by a factor of {LEAST_SPAN:g} or more"
        )
        raise ValueError(f"must have {rows}, and has {most}")
    named = [each for each in wide if wanted is None or wanted.lower() in each.name.lower()]
    if not named:
        raise ValueError(f"must have a section named {wanted}, and has {'; '.join(each.name for each in wide)}")
    taken = max(named, key=lambda each: each.span)
    (line, row), filled = taken.rows[0], max(i for i, cell in enumerate(taken.heading) if cell) + 1
    if any(re.fullmatch(NUMBER, cell, re.IGNORECASE) for cell in row[filled:]) and text[: len(REPTATE)] != REPTATE:
        raise ValueError(f"must have a heading over each column: line {line} has more numbers")
    return taken, [each.name for each in wide if each is not taken]


def _rows(text: str, separator: str) -> list[list[str]]:
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if separator == SEPARATORS[-1]:  # which splits no headings of several words
        lines = [line if "\t" not in line or not re.search(r"\w \w", line) else "" for line in lines]
    if len(separator) == 1:
        cells: Iterable[list[str]] = csv.reader(lines, delimiter=separator)
    else:  # numbers have no spaces in between that would be none
        cells = (re.split(separator if re.search(r"[^\W\d_eE]", x) else SEPARATORS[-1], x.strip()) for x in lines)
    rows = [[cell.replace("_", " ").replace('"', "''").strip() for cell in row] for row in cells]
    width = max(map(len, rows))
    return [row + [""] * (width - len(row)) for row in rows]


def _sections(option: str, rows: list[list[str]], separator: str) -> Iterator[Section]:
    """All tables with the columns of an option, split by the steps that their rows name."""
    heads = [(i, places) for i, row in enumerate(rows) if (places := _places(option, row))]
    for (start, places), (end, _) in pairwise([*heads, (len(rows), {})]):
        heading = rows[start]
        body = [(i + 1, rows[i]) for i in range(start + 1, end) if any(rows[i])]
        decimal = _decimal([cell for _, row in body for cell in row], separator)
        filled = max(i for i, cell in enumerate(heading) if cell) + 1
        if split := [i for i, row in body if separator == "," and "".join(row).isdigit() and any(row[filled:])]:
            raise ValueError(f"must not have commas in and between numbers: line {split[0]} has more than headings")
        if heading[0].endswith(":"):  # the name of a block; rows begin with a blank below it, or with their numbers
            body = [(line, row if np.isnan(_number(row[0], decimal)) else ["", *row]) for line, row in body]
        for i, _ in places.values():
            _refuse_thousands([row[i] for _, row in body], decimal)
        columns = {name: [_number(row[i], decimal) for _, row in body] for name, (i, _) in places.items()}
        numbers = pd.DataFrame(columns, dtype=float)
        measured = [*numbers.notna().any(axis=1), False]
        first = measured.index(True) if any(measured) else len(body)
        while first and not any(body[first - 1][1][i] for i, _ in places.values()):
            first -= 1  # points without numbers, which are counted
        of_step: dict[str, list[int]] = {}
        step = ""
        for k in range(first, len(body)):
            if measured[k] or not _is_text(body[k][1]):
                of_step.setdefault(_step(heading, body[k][1]) or step, []).append(k)
            elif measured[k + 1]:
                step = " ".join(body[k][1]).strip()
            else:
                break
        title = _title(rows, start)
        for step, mine in of_step.items():
            name = ", ".join(filter(None, (title, step)))
            name = f"section '{name}'" if name else f"the table below line {start + 1}"
            below = [row for _, row in body[:first]]
            yield Section(name, heading, places, below, [body[k] for k in mine], numbers.iloc[mine])


def _places(option: str, row: Sequence[str]) -> dict[str, tuple[int, str]]:
    """Place of each quantity's column and the rest of its heading; empty if the row is no line of headings."""
    if sum(cell[:1].isdigit() for cell in row) > 1:
        return {}
    found = {name: next(iter(each.items())) for name, each in places(option, row).items() if name != "force"}
    if "viscosity" in found:
        found.pop("stress", None)
    needed = [i for name, (i, _) in found.items() if name != "N1"]
    return found if len({*needed}) == len(needed) == NEEDED[option][0] else {}


def _is_text(row: Sequence[str]) -> bool:
    """Whether a row without numbers is a name, or begins another block."""
    filled = [cell for cell in row if cell]
    return filled[0].startswith("[") or filled[0].endswith(":") or (len(filled) == 1 and filled[0][0].isalpha())


def _step(heading: Sequence[str], row: Sequence[str]) -> str:
    """The step that a row names: in a column of its own (rSpace), or before the number of the point (RheoWin)."""
    named = next((cell for head, cell in zip(heading, row, strict=False) if re.fullmatch(STEPS, head.lower())), "")
    numbered = re.fullmatch(r"(\d+)\|\d+", row[0])
    return f"step {numbered[1]}" if numbered else named


def _title(rows: Sequence[Sequence[str]], start: int) -> str:
    """The name that stands before a table, "" if there is none."""
    above = [[cell for cell in row if cell] for row in rows[:start]]
    above = [row for row in reversed(above) if row]
    interval = ""
    for row, before in pairwise([*above, [""]]):
        if len(row) == 1 and before[0].lower() == "[step]":  # TRIOS
            return row[0]
        if len(row) > 1 and re.match("interval", row[0], re.IGNORECASE) and not interval:  # RheoCompass
            interval = f"interval {row[1]}"
        if len(row) > 1 and re.match(TITLES, row[0], re.IGNORECASE):
            return ", ".join(filter(None, (row[1], interval)))
    return interval


def _decimal(cells: Sequence[str], separator: str) -> str:
    """The decimal mark of a table.

    Raises:
        ValueError: Its commas may be decimal marks, thousands or separators.
    """
    numbers = [cell for cell in cells if re.fullmatch(NUMBER, cell, re.IGNORECASE)]
    commas = [cell for cell in numbers if "," in cell]
    if len(commas) <= sum("." in cell for cell in numbers):
        return "."
    if separator != ";" and all(re.fullmatch(r"[-+]?[1-9]\d{0,2},\d{3}", cell) for cell in commas):
        raise ValueError(f"has {commas[0]}, which may be one or a thousand; export it with decimal points")
    return ","


def _refuse_thousands(cells: Sequence[str], decimal: str) -> None:
    """Refuse a column as 1.500, 950, which neither rises nor falls: the mark may be of thousands."""
    steps = np.diff([value for cell in cells if np.isfinite(value := _number(cell, decimal))])
    marked = [cell for cell in cells if decimal in cell and re.fullmatch(NUMBER, cell, re.IGNORECASE)]
    whole = [cell for cell in cells if re.fullmatch(r"\d{3}", cell)]
    mixed = marked and whole and all(re.fullmatch(r"[1-9]\d{0,2}[.,]\d{3}", cell) for cell in marked)
    if mixed and (steps > 0).any() and (steps < 0).any():
        raise ValueError(f"has {marked[0]}, which may be one or a thousand; export it without marks of thousands")


def _number(cell: str, decimal: str) -> float:
    """A cell as a number, NaN if it is none; marks of thousands are read in numbers with decimals."""
    other = "," if decimal == "." else "."
    if re.fullmatch(rf"\d{{1,3}}([ '{other}]\d{{3}})+\{decimal}\d+", cell):
        cell = re.sub(rf"[ '{other}]", "", cell)
    is_number = re.fullmatch(NUMBER, cell, re.IGNORECASE) and other not in cell
    return float(cell.replace(decimal, ".")) if is_number else float("nan")


def _read(section: Section, columns: Mapping[str, Column], rates: Array) -> str:
    """The points, their range, and what was read of which column."""
    (_, rate), *others = columns.items()
    of_rate = f"{rates.min():.4g} to {rates.max():.4g} {rate.assumed}"
    if rate.factor != 1:
        of_rate += f" ({rate} in {rate.unit})"
    each = ", ".join(f"{WORDS.get(name, name)} in {of.unit or of.assumed} ({of})" for name, of in others)
    return f"{len(rates)} points, {of_rate}, {each} of {section.name}"


def _left_out(option: str, section: Section, columns: Mapping[str, Column]) -> Iterator[str]:
    """The rows that cannot be used, and the columns that look as if they could be."""
    if out := [k for k, usable in enumerate(section.usable) if not usable]:
        line, row = section.rows[out[0]]
        of_first = section.numbers.iloc[out[0]]
        place = next(columns[name] for name in columns if name != "N1" and not of_first[name] > 0)
        value = row[place.place]
        why = f"'{value}' is no positive number" if value else "is empty"
        yield f"{len(out)} of {len(section.rows)} rows left out; in the first one, line {line}, {place} {why}"
    named = places(option, section.heading)
    for name in [each for each in columns if each != "frequency"]:  # which many files have in Hz and in rad/s
        for i in named[name].keys() - {columns[name].place}:
            yield f'column {i + 1} "{section.heading[i]}" is not read, which may be {name}, too'
    if "N1" not in columns:
        for i in named.get("force", ()):
            yield f'column {i + 1} "{section.heading[i]}" is not read: N1 = 2 F/(pi R^2) needs the radius R of the cone'


def _without_noise(values: dict[str, Array]) -> Iterator[str]:
    """N1 is NaN up to the largest rate at which it is not positive: what is measured there is noise about zero."""
    noise = values["rate"][values["N1"] <= 0]
    if len(noise):
        values["N1"] = np.where(values["rate"] > noise.max(), values["N1"], np.nan)
        left = int(np.isfinite(values["N1"]).sum())
        yield f"N1 is not positive at up to {noise.max():.4g} 1/s: {left} of its points, at larger rates, are read"


def _assumed(file: Path, columns: Mapping[str, Column]) -> Iterator[str]:
    """Warnings of units that are not given, or may be meant in another way."""
    if without := [f"{each}, taken as {each.assumed}" for each in columns.values() if not each.unit]:
        units = f"no unit is given of {', '.join(without)}"
        yield f"warning: {file.name}: {units}; if it is another one, write it into the heading, as [mPa.s]"
    rate = next(iter(columns.values()))
    if rate.unit in ("1/s", "s-1") and re.match("f", rate.heading, re.IGNORECASE):
        yield f"warning: {rate} is taken as an angular frequency, in rad/s; if it counts cycles, its unit is Hz"


def _no_table(option: str, text: str) -> str:
    """Why a file has no table of an option."""
    _, wanted, example = NEEDED[option]
    rows = [row for separator in SEPARATORS for row in _rows(text, separator)]
    if other := next((each for each in NEEDED if each != option and any(_places(each, row) for row in rows)), None):
        return f"must have columns of {wanted}, and has those of {other}"
    of_words = (row for separator in SEPARATORS[:-1] for row in _rows(text, separator))
    if any(_places(option, row) for row in of_words):
        return f"must have rows of positive numbers, without units, below the headings of {wanted}"
    named = max(rows, key=lambda row: (len(places(option, row)), len(row) > 1))
    if not places(option, named):
        return f"must have a line of headings, such as {example}"
    return f"must have columns of {wanted}, such as {example}, and has {', '.join(filter(None, named[:8]))}"

"""Headings of the columns of flow curves and moduli in files of rheometers, and their units."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from pairsim.cases.quantity_text import unit_in

UNITS = {"rate": "1/s", "frequency": "rad/s", "phase": "deg", "factor": ""}
UNITS |= dict.fromkeys(("viscosity", "complex viscosity"), "Pa*s")
"""SI units of the quantities (phases in degrees); all others are stresses."""


@dataclass(frozen=True)
class Spellings:
    """Spellings in files of rheometers, as regular expressions; see headings.yaml.

    Attributes:
        columns: Names of columns by their quantities, the preferred ones first, for each kind of file.
        unlike: Headings that look like those of a quantity but mean something else, by quantity.
        no_values: Headings of columns without measured values.
        second_choice: Headings of columns that are read only if no other has their quantity.
        summary: The first cell of a row that is a summary of the rows above it.
        tests: A line above a table with the name of a test.
        samples: A line above a table with the name of a sample.
        of_something_else: Names of tables of anything but a liquid to be fitted, such as calibrations.
        east_asian: Words by which a Chinese or Japanese text is recognised.
        like_units: A text beside a name that is probably meant as a unit.
        signs: Characters that are written in several ways: all variants by the one that replaces them.
        units: Replacements in units, made one after the other, that lead to the notation of pint.
    """

    columns: Mapping[str, Mapping[str, Sequence[str]]]
    unlike: Mapping[str, str]
    no_values: str
    second_choice: str
    summary: str
    tests: str
    samples: str
    of_something_else: str
    east_asian: str
    like_units: str
    signs: Mapping[str, str]
    units: Mapping[str, str]


@cache
def spellings() -> Spellings:
    """The spellings in headings.yaml."""
    entries = YAML(typ="safe").load(Path(__file__).with_name("headings.yaml"))
    return Spellings(**{name.replace(" ", "_"): value for name, value in entries.items()})


def places(kind: str, row: Sequence[str]) -> dict[str, dict[int, str]]:
    """The cells of a row that name each quantity, the preferred ones first: their places, and the text after the name.

    Args:
        kind: "rheology" or "spectrum".
        row: The cells.

    Returns:
        By quantity, the text after its name by the place of the cell, from 0.
    """
    found: dict[str, dict[int, str]] = {}
    for quantity, names in spellings().columns[kind].items():
        unlike = f"{spellings().no_values}|{spellings().unlike.get(quantity, '$^')}"
        last = [bool(re.search(spellings().second_choice, cell, re.IGNORECASE)) for cell in row]
        for name, i in sorted(product(names, range(len(row))), key=lambda each: last[each[1]]):
            match = re.search(name, row[i], re.IGNORECASE)
            if match and not re.search(unlike, row[i], re.IGNORECASE):
                found.setdefault(quantity, {}).setdefault(i, row[i][match.end() :])
    return found


@dataclass(frozen=True)
class Column:
    """A column of a file."""

    place: int  # from 0
    heading: str
    unit: str
    factor: float  # the unit in SI units
    assumed: str  # the SI unit, which is assumed for a column without a unit

    def __str__(self) -> str:
        return f'column {self.place + 1} "{self.heading}"'


def column(quantity: str, place: int, heading: str, rest: str, around: Sequence[str]) -> Column:
    """A column with its unit.

    Args:
        quantity: Its quantity.
        place: Its place, from 0.
        heading: Its heading.
        rest: The text of the heading after the name of the quantity.
        around: Cells around the heading, which may have the unit.

    Raises:
        ValueError: The unit is unknown, has a factor, or is of another dimension; the message says which is needed.
    """
    of = UNITS.get(quantity, "Pa")
    si = of.replace("*", ".")
    if re.search(r"[x*] ?1(0|e[-+]?\d)", " ".join([heading, *around])):
        raise ValueError(f'must have a unit without a factor for "{heading}", such as {si}')
    in_brackets = re.findall(r"[\[(]([^\[\]()]*)[\])]", heading)
    after = re.sub(r"^[\s\])]*(in\b|[,/:;-])?\s*", "", rest)
    bare = re.fullmatch(r"[\[(](.*)[\])]", after)
    words_in = [*re.split(r"\bin\b|,", after)[1:], *re.findall(r"^\S{2,}", after)]
    pieces = [bare[1] if bare else after, *reversed(in_brackets), *words_in, *around]
    for text in [each.strip("[]() ") if each in around else each.strip() for each in pieces]:
        if text and (factor := factor_of(text, of)) is not None:
            return Column(place, heading, text.replace("*", "."), factor, si)
    of_words = [each for each in in_brackets if re.search(r"[^\W\d_].*[^\W\d_]", each)]
    named = [each for each in of_words if not any(places(kind, [each]) for kind in ("rheology", "spectrum"))]
    named += re.findall(r"\bin (.+)", rest)
    for text in [after, *named, *around]:
        unit = text.strip("[]() ")
        if unit and si and (re.search(spellings().like_units, unit) or text in named or f"[{unit}]" == text):
            raise ValueError(f'must have a unit such as {si} for "{heading}", not {unit.replace("*", ".")}')
    return Column(place, heading, "", 1.0, si)


def factor_of(text: str, of: str) -> float | None:
    """The size of the unit `text` in the unit `of`; None if it is no unit of this dimension."""
    turns = re.search("(?i)hz|hertz|rpm|rev|u/min|cycle", text)
    milli_or_mega = r"\bMPA\b|\bMPAS"
    if of == UNITS["viscosity"]:
        milli_or_mega += r"|\bMPa"  # no viscosity is meant in MPa.s, which spreadsheets make of mPa.s
    if re.fullmatch(r"[\d\s.]*", text) or re.search(milli_or_mega, text):
        return None
    if turns and of == UNITS["rate"]:
        return None  # a shear rate is no speed of rotation
    for spelled in (text, text.replace(" ", "/"), text.lower()):
        for pattern, by in spellings().units.items():
            spelled = re.sub(pattern, by, spelled)
        with suppress(ValueError):
            hertz = of == UNITS["frequency"] and re.search("(?i)hz|hertz", text)
            return unit_in(of, spelled) * (2 * np.pi if hertz else 1.0)
    return None

"""How the columns of flow curves and moduli are headed in files of rheometers, and which units stand there."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from pairsim.cases.quantities import unit_in_si
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.material import Dimension
from pairsim.physics.solids.solid import MODULUS


def _dimension(key: str, kind: str, unit: str) -> Dimension:
    return Dimension(key, kind, key, unit, f"1 {unit}", lambda value, _: value)


RATE, FREQUENCY = _dimension("rate", "a shear rate", "1/s"), _dimension("frequency", "a frequency", "rad/s")
DIMENSIONS = {
    "rate": RATE,
    "viscosity": ZERO_SHEAR,
    "frequency": FREQUENCY,
    "phase": _dimension("phase", "an angle", "deg"),
    "factor": _dimension("factor", "a number", ""),
}
"""What is in the columns; all others are stresses."""


@cache
def words() -> dict[str, Any]:
    """How columns are headed and units are written, see headings.yaml."""
    return YAML(typ="safe").load(Path(__file__).with_name("headings.yaml"))


def places(option: str, row: Sequence[str]) -> dict[str, dict[int, str]]:
    """Places of the cells that name a quantity, the preferred first, and what each says after the name."""
    found: dict[str, dict[int, str]] = {}
    for quantity, each in words()[option].items():
        unlike = f"{words()['no values']}|{each.get('unlike', '$^')}"
        for name in each["names"]:
            for i, cell in enumerate(row):
                match = re.search(name, cell, re.IGNORECASE)
                if match and not re.search(unlike, cell, re.IGNORECASE):
                    found.setdefault(quantity, {}).setdefault(i, cell[match.end() :])
    return found


@dataclass(frozen=True)
class Column:
    """A column of a file.

    Attributes:
        place: Its place, from 0.
        heading: Its heading.
        unit: Its unit as written, "" if none is.
        factor: The unit in SI units.
        assumed: The SI unit, for a column without one.
    """

    place: int
    heading: str
    unit: str
    factor: float
    assumed: str

    def __str__(self) -> str:
        return f'column {self.place + 1} "{self.heading}"'


def column(quantity: str, place: int, heading: str, rest: str, around: Sequence[str]) -> Column:
    """A column with its unit, from the heading, what it says after the name, and cells around it.

    Raises:
        ValueError: Its unit is not known, or is none of the dimension; says which.
    """
    dimension = DIMENSIONS.get(quantity, MODULUS)
    si = dimension.unit.replace("*", ".")
    if re.search(r"[x*] ?1(0|e[-+]?\d)", " ".join([heading, *around])):
        raise ValueError(f'must have a unit without a factor for "{heading}", as {si} is')
    in_brackets = re.findall(r"[\[(]([^\[\]()]*)[\])]", heading)
    after = re.sub(r"^[\s\])]*(in\b|[,/:;-])?\s*", "", rest)
    bare = re.fullmatch(r"[\[(](.*)[\])]", after)
    words_in = [*re.split(r"\bin\b|,", after)[1:], *re.findall(r"^\S{2,}", after)]
    pieces = [bare[1] if bare else after, *reversed(in_brackets), *words_in, *around]
    for text in [each.strip("[]() ") if each in around else each.strip() for each in pieces]:
        if text and (factor := _factor(text, dimension)) is not None:
            return Column(place, heading, text.replace("*", "."), factor, si)
    for text in [after, *in_brackets, *around]:
        unit = text.strip("[]() ")
        if unit and si and (re.search(words()["like units"], unit) or f"[{unit}]" in heading or f"[{unit}]" == text):
            raise ValueError(f'must have a unit as {si} is for "{heading}", not {unit.replace("*", ".")}')
    return Column(place, heading, "", 1.0, si)


def _factor(text: str, dimension: Dimension | None) -> float | None:
    """A unit in that of a dimension, None if it is no such unit; 1 for any unit if there is no dimension."""
    for spelled in (text, text.replace(" ", "/"), text.lower()):
        if re.fullmatch(r"[\d\s.]*", text) or re.search(r"\bMPA\b|\bMPAS", text):  # milli or mega?
            return None
        for pattern, by in words()["units"].items():
            spelled = re.sub(pattern, by, spelled)
        try:
            factor = unit_in_si(spelled, dimension)
        except ValueError:
            continue
        if dimension is RATE and re.search("(?i)hz|hertz|rpm|rev|u/min|cycle", text):
            return None  # the shear rate is no speed of rotation
        return factor * (2 * np.pi if dimension is FREQUENCY and re.search("(?i)hz|hertz", text) else 1.0)
    return None

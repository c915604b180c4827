"""How the columns of flow curves and moduli are headed in files of rheometers, and which units stand there."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pairsim.cases.quantities import unit_in_si
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.material import Dimension
from pairsim.physics.solids.solid import MODULUS

RATE = Dimension("rate", "a shear rate", "shear rate", "1/s", "1 1/s", lambda value, _: value)
FREQUENCY = Dimension("frequency", "a frequency", "angular frequency", "rad/s", "1 rad/s", lambda value, _: value)
NO_VALUES = r"\blog|\bstd\b|error|deviat|uncert|oscill|[ck]omplex"


@dataclass(frozen=True)
class Heading:
    """How the column of a quantity is headed.

    Attributes:
        dimension: What is in it.
        names: Regular expressions of its names, the preferred ones first.
        unlike: Regular expression of headings that are of something else.
    """

    dimension: Dimension
    names: tuple[str, ...]
    unlike: str = NO_VALUES

    def places(self, headings: Sequence[str]) -> dict[int, str]:
        """Places of the headings that name the quantity, the preferred first, and what each says after the name."""
        found: dict[int, str] = {}
        for name in self.names:
            for i, heading in enumerate(headings):
                match = re.search(name, heading, re.IGNORECASE)
                if match and not re.search(f"{NO_VALUES}|{self.unlike}", heading, re.IGNORECASE):
                    found.setdefault(i, heading[match.end() :])
        return found


HEADINGS = {
    "--rheology": {
        "rate": Heading(
            RATE,
            (
                r"(shear|strain) ?rate|scher(rate|geschwindigkeit|gefälle)|(gradient|vitesse|taux) de cisaillement",
                r"[γɣ]\u0307|[ẏý]|gamma ?(dot|point|punkt)|\bgp\b|^rate\b",  # noqa: RUF001
            ),
        ),
        "viscosity": Heading(
            ZERO_SHEAR,
            (r"visc(osit\w*|\b)|viskosit\w*", r"\beta\b|η"),
            r"(η|eta|visco\w*) ?\*|[|']|betrag|\b(re|im)\(|kinem|relati|spe[cz]if|intrinsi|extensi|redu[cz]|inherent",
        ),
        "stress": Heading(
            MODULUS,
            (
                r"shear ?stress|s(chub|cher)spannung|contrainte de cisaillement",
                r"^(stress|tau|sigma)\b|τ|σ",  # noqa: RUF001
            ),
            r"normal|yield|sinus|amplitud",
        ),
        "N1": Heading(
            MODULUS,
            (r"\bn ?1\b", r"normal ?(stress|spannung)(s?differen\w*| differen\w*)?|contraintes? normales?"),
            r"force|kraft|[ck]oeff|se[ck]ond|zweite|\bn ?2\b|\b2\.",
        ),
    },
    "--spectrum": {
        "frequency": Heading(
            FREQUENCY,
            (
                r"angular ?freq\w*|(kreis|winkel)freq\w*|fréquence angulaire|\bpulsation|\bomega\b|ω",
                r"\bfr[eé]q\w*|(?-i:^[fw]\b)",
            ),
        ),
        "storage": Heading(
            MODULUS,
            (
                r"storage ?modul\w*|speichermodul|module de (stockage|conservation)|elastic (modul\w*|component)",
                r"\bg ?'(?!')|\bg ?prime|\bgp\b|\bg1\b",
            ),
            r"tan|compliance|g'+ ?/ ?g",
        ),
        "loss": Heading(
            MODULUS,
            (
                r"loss ?modul\w*|verlustmodul|module de perte|viscous (modul\w*|component)",
                r"\bg ?''|\bg ?double ?prime|\bgpp\b|\bg2\b",
            ),
            r"tan|compliance|g'+ ?/ ?g",
        ),
    },
}
"""The columns in the file of each option, in English, German and French."""
FORCE = Heading(MODULUS, (r"(normal|axial) ?(force|kraft)|force normale",))

SPELLINGS = (
    (r"(?<=[A-Za-zµμ])[ .-](?=[A-Za-z])", "*"),  # Pa.s, mPa s, Pa-s
    (r"(?i:pa)\*?s(ec)?\b", "Pa*s"),  # mPas, which pint takes for several mPa
    (r"(?<![A-Za-z])([mk]?)(?i:pa)\b", r"\1Pa"),
    (r"(?i:hz)\b", "Hz"),
    (r"(?i:\bcps?)\b", "cP"),
    (r"\bNs\b", "N*s"),
    (r"^/", "1/"),
    (r"(?<=[A-Za-z])\^?(-?\d+)", r"**\1"),  # s-1, cm^2
)
"""Units as rheometers and spreadsheets write them, in the way of pint; superscripts and dots are plain before."""


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


def column(dimension: Dimension, place: int, heading: str, rest: str, below: Sequence[str]) -> Column:
    """A column with its unit, from the heading, what it says after the name, and cells between heading and numbers.

    Raises:
        ValueError: Its unit is not known, or is none of the dimension; says which.
    """
    si = dimension.unit.replace("*", ".")
    in_brackets = re.findall(r"[\[(]([^\[\]()]*)[\])]", heading)
    after = re.sub(r"^[\s\])]*(in\b|[,/:;-])?\s*", "", rest)
    bare = re.fullmatch(r"[\[(](.*)[\])]", after)
    pieces = [bare[1] if bare else after, *reversed(in_brackets), *re.split(r"\bin\b|,", after)[1:]]
    for text in [each.strip() for each in (*pieces, *(cell.strip("[]() ") for cell in below)) if each.strip()]:
        if (factor := _factor(text, dimension)) is not None:
            return Column(place, heading, text.replace("*", "."), factor, si)
    for text in [*in_brackets, *below]:
        unit = text.strip("[]() ")
        if unit and (_factor(unit, None) is not None or any(f"[{unit}]" in each for each in (text, heading))):
            raise ValueError(f'must have a unit as {si} is for "{heading}", not {unit.replace("*", ".")}')
    return Column(place, heading, "", 1.0, si)


def _factor(text: str, dimension: Dimension | None) -> float | None:
    """A unit in that of a dimension, None if it is no such unit; 1 for any unit if there is no dimension."""
    for spelled in (text, text.replace(" ", "/"), text.lower()):
        if re.fullmatch(r"[\d\s.]*", text) or re.search(r"\bMPA\b|\bMPAS", text):  # milli or mega?
            return None
        for pattern, by in SPELLINGS:
            spelled = re.sub(pattern, by, spelled)
        try:
            factor = unit_in_si(spelled, dimension)
        except ValueError:
            continue
        if dimension is RATE and re.search("(?i)hz|hertz|rpm|rev|u/min|cycle", text):
            return None  # the shear rate is no speed of rotation
        return factor * (2 * np.pi if dimension is FREQUENCY and re.search("(?i)hz|hertz", text) else 1.0)
    return None

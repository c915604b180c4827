"""The columns that the table of a film may have, and the headings that programs and people give them."""

from __future__ import annotations

from dataclasses import dataclass

_OF = r"( ?(id|ids|n\W?|nr|no|num|number|index|idx|#))?"
_TRACK = r"(particle|track(ing|let)?|traj(ectory)?|bead|sphere|drop(let)?|cell)"
_PLACE = r"(pos(ition)?|coord(inate)?|(location )?cent(er|re|roid))"
_CENTRE = r"cent(er|re|roid)s?"


@dataclass(frozen=True)
class Heading:
    """A kind of column in the table of a film.

    Attributes:
        name: Its name in messages.
        spellings: Regular expressions for the headings of such columns, in lower case and with spaces for other
            separators; the preferred ones first.
        unit: SI unit of its values, "" if they have none.
    """

    name: str
    spellings: tuple[str, ...]
    unit: str = ""


TIME = Heading(
    "t",
    (r"t|time|zeit|temps|tiempo|tempo|(pos|position) t|t position", r"elapsed( time)?|time ?stamps?"),
    "s",
)
FRAME = Heading("frame", (rf"(frame|slice|image|img|bild|time ?point){_OF}|time index|stack position",))
PARTICLE = Heading(
    "particle", (rf"{_TRACK}{_OF}|id of track|trackobjects label( \d+)?", rf"(object|individual|animal){_OF}|id")
)
X = Heading("x", (rf"x|{_PLACE} x|x {_PLACE}|cx", r"x ?m", r"(weighted )?centroid 1"), "m")
Y = Heading("y", (rf"y|{_PLACE} y|y {_PLACE}|cy", r"y ?m", r"(weighted )?centroid 0"), "m")
SURFACES = Heading(
    "d", (r"d|gap|surface( to surface)? (distance|separation|gap)|(distance|gap) (of|between)( the)? surfaces",), "m"
)
CENTRES = Heading(
    "c",
    (rf"c|{_CENTRE}( to {_CENTRE})? (distance|separation)|(distance|separation) (of|between)( the)? {_CENTRE}",),
    "m",
)
HEADINGS = (TIME, FRAME, PARTICLE, X, Y, SURFACES, CENTRES)
LENGTHS = (X, Y, SURFACES, CENTRES)
"""Positions, and distances between surfaces and between centres."""

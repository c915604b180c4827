"""Critical distances along three lines through one case: the parts of the study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from book import yaml_files
from book.case_parts import case_of, case_part
from book.study import Part

PAIR = yaml_files.read(Path(__file__).with_name("pair.yaml"))
CENTRE = {"De": 0.5, "alpha": 0.2, "beta": 0.4}
LINES = {"De": (0.25, 1.0), "alpha": (0.1, 0.4), "beta": (0.3, 0.5)}
"""Values of each parameter beside that of the centre."""
KEYS = {"alpha": "liquid.alpha"}
COARSE = {"mesh": {"Np": 12, "max_size": 0.2}}


def parts(quick: bool) -> list[Part]:
    """Seven cases; in the quick form two on coarse cells."""
    lines = {"De": (1.0,)} if quick else LINES
    places = [CENTRE, *(CENTRE | {name: value} for name, values in lines.items() for value in values)]
    return [_part(place, COARSE if quick else {}) for place in places]


def _part(place: dict[str, float], more: dict[str, Any]) -> Part:
    case = case_of(PAIR, **{KEYS.get(name, name): value for name, value in place.items()}, **more)
    name = ", ".join(f"{key} {value:g}" for key, value in place.items())
    return case_part(name, "critical", case, ("d_cr", "d_error", "stable", "kind"), dict(place))

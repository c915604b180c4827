"""The lines of six maps, each a file of this folder for `pairsim sweep`: the parts of the study."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from book import yaml_files
from book.case_parts import case_of, cases_part, grid
from book.study import Part, Row

HERE = Path(__file__).parent
LINES = {
    "soft-bead": ("beta",),
    "elastic-bead": ("beta",),
    "bead": ("beta", "De"),
    "rigid-pairs": ("beta",),
    "soft-pairs": ("beta", "Ca_e"),
    "elastic-pairs": ("beta", "d"),
}
"""The maps, each with the parameters that are the same along a line of it, which is a part."""
PARAMETERS = ("beta", "De", "Ca_e", "d")
SHOWN = ("verdict", "growth", "growth_error", "tube", "Re_c")
COARSE = {"mesh": {"Np": 10, "max_size": 0.15}}


def cases_of(name: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """What all cases of a map share, and the parameters of each."""
    content = yaml_files.read(HERE / f"{name}.yaml")
    lists = content.get("zip")
    together = [dict(zip(lists, each, strict=True)) for each in zip(*lists.values(), strict=True)] if lists else [{}]
    return content["base"], [zipped | point for zipped in together for point in grid(**content["grid"])]


def parts(quick: bool) -> list[Part]:
    """The lines of all maps; in the quick form two places of one of each kind of bead, on coarse cells."""
    if quick:
        return [_line(name, cases_of(name)[1][7:9], COARSE) for name in ("soft-bead", "elastic-bead")]
    found = []
    for name, keys in LINES.items():
        points = cases_of(name)[1]

        def line_of(point: dict[str, Any], keys: Sequence[str] = keys) -> list[float]:
            return [point[key] for key in keys]

        found += [_line(name, list(line)) for _, line in groupby(sorted(points, key=line_of), line_of)]
    return found


def _line(name: str, points: Sequence[dict[str, Any]], more: dict[str, Any] | None = None) -> Part:
    """A line of a map."""
    base, _ = cases_of(name)
    same = ", ".join(f"{key} {points[0][key]:g}" for key in LINES[name])
    cases: list[tuple[Row, dict[str, Any]]] = [
        (
            {"map": name, **{key: float((base | point).get(key, "nan")) for key in PARAMETERS}},
            case_of(base, **point, **more or {}),
        )
        for point in points
    ]
    return cases_part(f"{name}, {same}", "focus", cases, SHOWN)

"""What the atlases are judged by: forty curves, random places, and derivatives by the difference of the diameters."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from book.case_parts import LIMIT, cases_part
from book.study import Part, Row, computed

from pairsim.atlas import atlas as shipped
from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.runtime.arrays import Array

HERE = Path(__file__).parent
SHARED = ("ends", "length", "xi", "liquid", "solid")
"""Keys of an atlas's cases that decide what is computed."""
DISTANCES = (0.02, 0.03, 0.05, 0.08, 0.12, 0.19, 0.3, 0.45, 0.7, 1.1, 1.5, 2.0)
"""Of the curves [D_c]."""
OF_CURVES, OF_PLACES = "0.1%", "0.3%"
"""Accuracies."""
TOGETHER = 10  # random places in a part


class Sample(NamedTuple):
    """Random places of an atlas.

    Attributes:
        atlas: Its name.
        region: What the sample is called.
        size: Number of places.
        seed: What they are drawn with.
        narrower: Ranges of parameters in place of those of the atlas.
    """

    atlas: str
    region: str
    size: int
    seed: int
    narrower: Mapping[str, tuple[float, float]]


SAMPLES = (
    Sample("newtonian", "box", 200, 11, {}),
    Sample("equal-pairs", "box", 200, 12, {}),
    Sample("equal-pairs", "corner", 50, 13, {"De": (0.0, 0.1), "beta": (0.42, 0.5), "Ca_e": (0.06, 0.1)}),
)
COARSE = {"mesh": {"Np": 16}, "tol": 1}
"""Of curves with sensitivities, whose derivatives are within 1 % of those of finer meshes; no points are added."""
WITH_DIFFERENCES = (
    (0.4, 0.0, 0.05),
    (0.3, 0.0, 0.1),
    (0.5, 0.0, 0.05),
    (0.4, 1.0, 0.0),
    (0.4, 0.3, 0.1),
    (0.5, 1.0, 0.1),
)
"""Places with derivatives by the difference of the diameters."""


@cache
def atlas_of(name: str) -> Atlas:
    """An atlas that ships."""
    return Atlas.load(Path(shipped.__file__).with_name(f"{name}.npz"))


def random_places(sample: Sample) -> Array:
    """Random beta, De, Ca_e and d in the box of an atlas, or in a part of it, shape (count, 4).

    All are uniform; d of every other place is uniform in log d, as otherwise half of them had d > 1, where dU is small.
    """
    box = atlas_of(sample.atlas).box
    ends = np.array([sample.narrower.get(name, box[name]) for name in (*PARAMETERS, "d")], dtype=float)
    x = np.random.default_rng(sample.seed).random((sample.size, 4))
    found = ends[:, 0] + (ends[:, 1] - ends[:, 0]) * x
    found[1::2, 3] = ends[3, 0] * (ends[3, 1] / ends[3, 0]) ** x[1::2, 3]
    return np.array([[float(f"{value:.6g}") for value in row] for row in found])


def case_at(name: str, beta: float, De: float, Ca_e: float, d: Sequence[float], **more: Any) -> dict[str, Any]:
    """The case of a place of an atlas."""
    content = atlas_of(name).provenance["case"]
    liquid = {key: content[key] for key in SHARED if key in content and (De or key not in ("liquid", "xi"))}
    return {**liquid, "beta": beta, "De": De, "Ca_e": Ca_e, "d": list(d), **more}


def parts(quick: bool) -> list[Part]:
    """All curves, places and derivatives; in the quick form two places and one curve with derivatives."""
    curves = [tuple(map(float, place)) for place in pd.read_csv(HERE / "places.csv").to_numpy()]
    samples = [sample._replace(size=2) for sample in SAMPLES[:1]] if quick else SAMPLES
    return [
        *(_curve(place) for place in ([] if quick else curves)),
        *(part for sample in samples for part in _places(sample)),
        *(_difference(place) for place in WITH_DIFFERENCES[: 1 if quick else None]),
    ]


def _named(place: Sequence[float]) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in zip(PARAMETERS, place, strict=True))


def _curve(place: Sequence[float]) -> Part:
    """A curve of the Giesekus atlas: dU at the distances, and its zeros, where dU is 0 and the half-width that of d."""
    case = case_at("equal-pairs", place[0], place[1], place[2], DISTANCES, accuracy=OF_CURVES)
    about: Row = {"kind": "curve", "atlas": "equal-pairs", **dict(zip(PARAMETERS, place, strict=True))}

    def rows(folder: Path) -> list[Row]:
        result = computed("curve", case, folder, LIMIT)
        if result.status != "finished":
            return [{**about, "ended": result.reason or result.status}]
        table = result.table[result.table["d"].round(9).isin(DISTANCES)]
        columns = {"d": table["d"], "dU": table["dU"], "dU_error": table["dU_error"]}
        zeros = result.zeros
        points = [
            *zip(*columns.values(), strict=True),
            *((d, 0.0, e) for d, e in zip(zeros["d"], zeros["d_error"], strict=True)),
        ]
        return [
            {**about, "d": float(d), "dU": float(dU), "dU_error": float(e), "ended": None}
            for d, dU, e in sorted(points)
        ]

    return Part(f"curve, {_named(place)}", json.dumps(case, sort_keys=True), rows)


def _places(sample: Sample) -> list[Part]:
    """Random places, some of them a part."""
    found = []
    where = random_places(sample).tolist()
    for first in range(0, len(where), TOGETHER):
        cases: list[tuple[Row, dict[str, Any]]] = [
            (
                {"kind": "place", "atlas": sample.atlas, "region": sample.region, "beta": beta, "De": De, "Ca_e": Ca_e},
                case_at(sample.atlas, beta, De, Ca_e, [d], accuracy=OF_PLACES),
            )
            for beta, De, Ca_e, d in where[first : first + TOGETHER]
        ]
        name = f"places, {sample.atlas}, {sample.region}, from {first}"
        found.append(cases_part(name, "curve", cases, ("d", "dU", "dU_error")))
    return found


def _difference(place: Sequence[float]) -> Part:
    """A curve with its derivatives by the difference of the diameters."""
    name = "equal-pairs" if place[1] else "newtonian"
    case = case_at(name, place[0], place[1], place[2], DISTANCES, **COARSE)
    about: Row = {"kind": "difference", "atlas": name, **dict(zip(PARAMETERS, place, strict=True))}
    return Part(f"difference, {_named(place)}", json.dumps(case, sort_keys=True), partial(_derivatives, case, about))


def _derivatives(case: Mapping[str, Any], about: Row, folder: Path) -> list[Row]:
    result = computed("curve", case, folder, LIMIT, {"sensitivities": True})
    if result.status != "finished":
        return [{**about, "ended": result.reason or result.status}]
    pairs = zip(result.table["d"], result.table["by_difference"], strict=True)
    return [{**about, "d": float(d), "by_difference": float(value), "ended": None} for d, value in pairs]

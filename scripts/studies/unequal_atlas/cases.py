"""Curves of unequal pairs at places drawn at random, none of which the atlases were made of: the parts of the study.

Places have a fixed seed. Their beads are in the box of the atlas of their liquid, their ratios uniform in logarithms
over the ranges of the atlas; in every third pair both ratios are at ends of these. The liquids take turns, so that
wherever the computation ends, each has its share.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from book.study import Part, Row, computed

type Range = tuple[float, float]
type Case = dict[str, Any]

DIAMETERS, MODULI = (0.9, 1.1), (0.5, 2.0)  # ratios, of the leading bead to the trailing one
SOFTEST = 0.1  # Ca_e
PAIRS = 40
DISTANCES = (0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.2, 2.0)
ACCURACY = "1%"
LIMIT = 3600.0  # wall time of a curve [s]


@dataclass(frozen=True)
class Liquid:
    """A liquid of which an atlas ships.

    Attributes:
        name: Its name in the study.
        beta: Least and largest beta of the atlas.
        De: Least and largest De.
        keys: What its cases have beside the pair.
    """

    name: str
    beta: Range
    De: Range
    keys: Mapping[str, Any]


GIESEKUS = Liquid("giesekus", (0.3, 0.5), (0.0, 1.0), {"xi": 0.09, "liquid": {"law": "giesekus", "alpha": 0.2}})
NEWTONIAN = Liquid("newtonian", (0.2, 0.5), (0.0, 0.0), {})
TURNS = (GIESEKUS, GIESEKUS, NEWTONIAN, GIESEKUS)


def pairs(count: int = PAIRS, seed: int = 85) -> list[tuple[Liquid, Case]]:
    """Pairs of beads, each with its liquid; beta and Ca_e are lists from upstream, as in case files."""
    random = np.random.default_rng(seed)
    found = []
    for number in range(count):
        liquid, (a, b, c, size, softness) = TURNS[number % len(TURNS)], random.random(5)
        if number % 3 == 0:
            size, softness = round(size), round(softness)
        larger, stiffer = _between_logarithms(DIAMETERS, size), _between_logarithms(MODULI, softness)
        low, high = liquid.beta
        trailing = _between((max(low, low / larger), min(high, high / larger)), a)
        softest = SOFTEST * c
        Ca_e = [softest, softest / stiffer] if stiffer > 1 else [softest * stiffer, softest]
        numbers = {"beta": [trailing, trailing * larger], "De": _between(liquid.De, b), "Ca_e": Ca_e}
        found.append((liquid, {key: _rounded(value) for key, value in numbers.items()}))
    return found


def parts(quick: bool) -> list[Part]:
    """A curve of each pair, or two in the Newtonian liquid of few distances."""
    drawn = list(enumerate(pairs()))
    if quick:
        drawn = [(number, (liquid, pair)) for number, (liquid, pair) in drawn if liquid is NEWTONIAN][:2]
    distances = DISTANCES[2::2] if quick else DISTANCES
    return [_part(f"{number:02d}-{liquid.name}", liquid, pair, distances) for number, (liquid, pair) in drawn]


def _part(name: str, liquid: Liquid, pair: Case, distances: Sequence[float]) -> Part:
    """The curve of a pair at some distances alone."""
    case = {**liquid.keys, **pair, "ends": "developed", "length": "auto", "accuracy": ACCURACY}
    case |= {"d": list(distances), "max_points": len(distances)}
    about: dict[str, Any] = {"liquid": liquid.name, "De": pair["De"]}
    about |= {f"{key}{end}": pair[key][i] for key in ("beta", "Ca_e") for i, end in enumerate(("_T", "_L"))}
    return Part(name, json.dumps(case, sort_keys=True), partial(_rows, case, about))


def _rows(case: Case, about: Row, folder: Path) -> list[Row]:
    """The rows of a curve, one for each distance, or one that says how it ended."""
    result = computed("curve", case, folder, LIMIT)
    start = {**about, "unknowns": result.record.unknowns or 0, "seconds": result.record.wall_time or 0}
    if result.status != "finished":
        return [{**start, "ended": result.reason or result.status}]
    table = result.table[["d", "dU", "dU_error"]].to_dict("records")
    return [{**start, **row, "ended": None} for row in table]


def _between(ends: Range, part: float) -> float:
    return ends[0] + (ends[1] - ends[0]) * part


def _between_logarithms(ends: Range, part: float) -> float:
    return float(ends[0] * (ends[1] / ends[0]) ** part)


def _rounded(value: Any) -> Any:
    return [_rounded(each) for each in value] if isinstance(value, list) else float(f"{value:.6f}")

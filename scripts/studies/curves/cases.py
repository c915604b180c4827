"""Curves of pairs drawn at random, each at the default accuracy and at a finer one: the parts of the study.

Each curve has a seed of its own, and the laws take turns, so that all have about as many wherever the computation ends.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from math import log10
from pathlib import Path
from typing import Any

import numpy as np
from book.study import Part, Row
from book.timed import timed

from pairsim.solvers.goals import dU

LAWS: dict[str, dict[str, float]] = {
    "newtonian": {},
    "giesekus": {"alpha": 0.2},
    "oldroyd-b": {},
    "ptt-exp": {"epsilon": 0.1},
    "fene-p": {"L2": 100},
    "power-law": {"n": 0.7},
}
"""The laws with their parameters, in turn."""
WITHOUT_MEMORY = ("newtonian", "power-law")
SEED, CURVES = 87, 20
POINTS = 4  # distances of a curve
DIGITS = 4  # after the point, of all numbers that are drawn
BETA, DE, CA_E, D = (0.2, 0.5), (0.05, 1.2), (0.01, 0.1), (0.03, 1.0)
"""What they are drawn from: beta and De evenly, Ca_e and d evenly in their logarithms."""
OLDROYD_B = 0.6  # factor of De in an Oldroyd-B liquid, whose stress grows without bound
SOFT = 0.75  # probability that the pair is soft in a liquid with a memory; in others dU of rigid pairs is 0
ACCURACIES = ("1%", "0.2%")
"""That which is judged, and that of the reference."""
QUICK, QUICK_ACCURACIES = (0, 6), ("5%", "1%")


def case(number: int) -> dict[str, Any]:
    """A curve; few points are added to its own (`tol: 1`)."""
    law = list(LAWS)[number % len(LAWS)]
    random = np.random.default_rng([SEED, number])
    De = 0.0 if law in WITHOUT_MEMORY else float(random.uniform(*DE))
    De *= OLDROYD_B if law == "oldroyd-b" else 1.0
    soft = random.random() < SOFT or De == 0
    beta = round(float(random.uniform(*BETA)), DIGITS)
    Ca_e = round(float(10 ** random.uniform(log10(CA_E[0]), log10(CA_E[1]))), DIGITS) if soft else 0.0
    d = sorted(round(float(10**x), DIGITS) for x in random.uniform(log10(D[0]), log10(D[1]), POINTS))
    return {"beta": beta, "De": round(De, DIGITS), "Ca_e": Ca_e, "liquid": {"law": law, **LAWS[law]}, "d": d, "tol": 1}


def parts(quick: bool) -> list[Part]:
    """All curves, or two in a Newtonian liquid on coarser cells."""
    numbers, accuracies = (QUICK, QUICK_ACCURACIES) if quick else (range(CURVES), ACCURACIES)
    return [_part(number, accuracies, accuracy) for number in numbers for accuracy in accuracies]


def _part(number: int, accuracies: Sequence[str], accuracy: str) -> Part:
    """A curve at an accuracy."""
    drawn = case(number)
    law, asked = drawn["liquid"]["law"], {**drawn, "accuracy": accuracy}
    kind = "case" if accuracy == accuracies[0] else "reference"
    about: Row = {"curve": number, "law": law, "kind": kind, "accuracy": accuracy}
    identity = json.dumps({"command": "curve", **asked}, sort_keys=True)
    return Part(f"{number:02d}-{law}+{accuracy}", identity, partial(_rows, asked, about))


def _rows(asked: Mapping[str, Any], about: Row, _: Path) -> list[Row]:
    """The rows of a curve, one for each distance that was drawn, or one that says how it ended.

    `peak` is the largest |dU|, of which the accuracy is a part; `said` whether a warning says that this was not kept.
    """
    result, seconds = timed("curve", asked)
    start: Row = {**about, **{name: asked[name] for name in ("beta", "De", "Ca_e")}, "seconds": seconds}
    if result.status != "finished" or not len(result.table):
        return [{**start, "ended": result.reason or result.status}]
    record = result.record
    said = any(each.startswith("accuracy: ") and dU.error_column in each for each in result.warnings)
    start = {**start, "unknowns": record.unknowns or 0, "peak": record["adaptation"]["reference_dU"], "said": said}
    table = result.table.assign(d=result.table["d"].round(DIGITS))
    drawn = table[table["d"].isin(asked["d"])]
    return [{**start, **row, "ended": None} for row in drawn[["d", "dU", "dU_error"]].to_dict("records")]

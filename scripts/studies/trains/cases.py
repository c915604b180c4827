"""Infinite trains at two accuracies, and waves of some of them in runs in time: the parts of the study."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from book.study import Part, Row
from book.timed import timed
from book.uses import OF_CASES, in_time, physics, solvers

from pairsim.record.columns import Z
from pairsim.runtime.arrays import Array

OF_TRAINS = (
    *physics(),
    *solvers("curves", "errors", "nonlinear", "steady", "trains"),
    *solvers("goals", "mesh_transfer", "meshed_scene", "parameters", "problems", "solution"),
    *OF_CASES,
)
"""Code that trains depend on."""
OF_RUNS = (*in_time(), *OF_CASES)
"""Code that runs depend on."""
ACCURACIES, COARSE = ("1%", "0.2%"), ("5%", "1%")
"""Those of the train that is judged and of its reference; the same of the quick form."""
WAVES = (2, 4)  # beads of the waves that are followed in time
DISPLACED = 0.01  # largest displacement of a bead at first, over the spacing


@dataclass(frozen=True)
class InTime:
    """How waves of a train are followed in time.

    Attributes:
        Np: Cells on a half-circle.
        since: Time from which the rate is taken, once the start-up has decayed [D_c/U_av].
        end: Time at which runs end.
    """

    Np: int
    since: float
    end: float


@dataclass(frozen=True)
class Beads:
    """Equal beads with equal distances.

    Attributes:
        name: Their name in the study.
        keys: Diameter, liquid and solid.
        spacing: Distance of the centres of neighbours [D_c].
        in_time: How runs follow them; None where none does.
    """

    name: str
    keys: Mapping[str, Any]
    spacing: float
    in_time: InTime | None = None


TRAINS = (
    Beads("soft, Newtonian", {"beta": 0.4, "De": 0, "Ca_e": 0.1}, 0.52, InTime(28, 2.0, 6.0)),
    Beads("rigid, Giesekus, De 1", {"beta": 0.4, "De": 1, "Ca_e": 0}, 0.8, InTime(24, 8.0, 16.0)),
    Beads("soft, Giesekus, De 0.5", {"beta": 0.4, "De": 0.5, "Ca_e": 0.05}, 0.6, InTime(24, 4.0, 8.0)),
    Beads("rigid, Giesekus, De 0.25", {"beta": 0.4, "De": 0.25, "Ca_e": 0}, 0.5),
    Beads("softer and smaller, Newtonian", {"beta": 0.25, "De": 0, "Ca_e": 0.2}, 0.4),
    Beads(
        "soft, exponential PTT, De 0.5",
        {"beta": 0.3, "De": 0.5, "Ca_e": 0.05, "liquid": {"law": "ptt-exp", "epsilon": 0.1}},
        0.5,
    ),
)


def parts(quick: bool) -> list[Part]:
    """All trains and waves; in the quick form the first train on coarser cells, and its shorter wave."""
    chosen, accuracies, waves = (TRAINS[:1], COARSE, WAVES[:1]) if quick else (TRAINS, ACCURACIES, WAVES)
    found = [
        _train(beads, accuracy, "case" if accuracy == accuracies[0] else "reference")
        for beads in chosen
        for accuracy in accuracies
    ]
    return found + [_wave(beads, beads.in_time, count) for beads in chosen if beads.in_time for count in waves]


def _train(beads: Beads, accuracy: str, kind: str) -> Part:
    """A train at an accuracy."""
    case = {**beads.keys, "train": {"spacing": beads.spacing}, "accuracy": accuracy}
    identity = json.dumps({"command": "train", **case}, sort_keys=True)
    about: Row = {"train": beads.name, "kind": kind, "accuracy": accuracy}
    return Part(f"{beads.name}+{accuracy}", identity, partial(_rates, case, about), OF_TRAINS)


def _rates(case: Mapping[str, Any], about: Row, _: Path) -> list[Row]:
    """A row for each wave of the cell."""
    result, seconds = timed("train", case)
    if result.status != "finished" or not len(result.table):
        return [{**about, "seconds": seconds, "ended": result.reason or result.status}]
    said = any(each.startswith("accuracy: ") for each in result.warnings)
    same: Row = {**about, "seconds": seconds, "unknowns": result.record.unknowns or 0, "said": said}
    same = {**same, "verdict": str(result.table["verdict"].iloc[0])}
    waves = result.frame("spectrum").to_dict("records")
    return [{**same, "beads": round(2 * np.pi / wave["k"], 6), **wave, "ended": None} for wave in waves]


def _wave(beads: Beads, run: InTime, count: int) -> Part:
    """A wave of so many beads, in runs of a cell of as many, with displacements of both signs."""
    cases = list(_runs(beads, run, count))
    identity = json.dumps({"command": "run", "since": run.since, "cases": cases}, sort_keys=True)
    about: Row = {"train": beads.name, "kind": "run", "beads": count}
    rate = partial(_rate, cases, beads.spacing, run.since, about)
    return Part(f"{beads.name}, wave of {count}", identity, rate, OF_RUNS)


def _runs(beads: Beads, run: InTime, count: int) -> Iterator[dict[str, Any]]:
    """The runs: the beads at first where they belong, displaced by a cosine, and by its opposite."""
    for sign in (1, -1):
        x = sign * DISPLACED * beads.spacing * np.cos(2 * np.pi * np.arange(count) / count)
        gaps = beads.spacing - beads.keys["beta"] + np.diff(x)
        yield {
            **{**beads.keys, "particles": count, "ends": "repeated", "length": round(count * beads.spacing, 9)},
            **{"d0": [round(float(gap), 9) for gap in gaps], "time": {"end": run.end}, "mesh": {"Np": run.Np}},
            **{"output": {"fields": False}},
        }


def _rate(cases: list[dict[str, Any]], spacing: float, since: float, about: Row, _: Path) -> list[Row]:
    """The growth rate and frequency of the wave, in one row."""
    found = [timed("run", case) for case in cases]
    same: Row = {**about, "seconds": sum(seconds for _, seconds in found)}
    results = [result for result, _ in found]
    ended = [result.reason or result.status for result in results if result.status != "finished"]
    if ended:
        return [{**same, "ended": ", ".join(ended)}]
    one, other = (wave_of(result.table, spacing, len(cases[0]["d0"]) + 1) for result in results)
    rate = rate_of(one, other, since)
    return [{**same, "growth": rate.real, "frequency": rate.imag, "ended": None}]


def wave_of(table: pd.DataFrame, spacing: float, count: int) -> tuple[Array, Array]:
    """Times of a run, and the complex amplitude of the wave of `count` beads [D_c]."""
    z = table[[Z.name + suffix for suffix in Z.suffixes(count)]].to_numpy()
    x = z - spacing * np.arange(count)
    return table["t"].to_numpy(), x @ np.exp(-2j * np.pi * np.arange(count) / count)


def rate_of(one: tuple[Array, Array], other: tuple[Array, Array], since: float) -> complex:
    """The rate at which a wave changes from a time on, without terms of second order [U_av/D_c].

    Args:
        one: Times and amplitudes of a run.
        other: Those of a run with the opposite displacements.
        since: The time.
    """
    (t, a), (s, b) = one, other
    mean = (a - np.interp(t, s, b)) / 2
    first = int(np.searchsorted(t, since))
    return complex(np.log(mean[-1] / mean[first]) / (t[-1] - t[first]))

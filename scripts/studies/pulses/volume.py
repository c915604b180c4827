"""Rigid particles in a Newtonian liquid, whose distances depend on the displaced volume alone."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from book.study import Part, Row, computed

from studies.pulses.runs import LIMIT, Case, Run, how, of_steady_flow

TOPIC = "volume"
MEAN = 0.4  # volume that a cycle of length 1 displaces, over the section of the tube [D_c]
TOLERANCES = (1e-3, 1e-4)
RIGID: dict[str, Any] = {"De": 0, "Ca_e": 0, "length": 4, "ends": "developed", "output": {"fields": False}}
RIGID |= {"mesh": {"Np": 20, "max_size": 0.2}}
PAIR: Case = {**RIGID, "beta": [0.35, 0.4], "d0": 0.2}
THREE: Case = {**RIGID, "beta": 0.4, "particles": 3, "d0": [0.2, 0.4]}
CURVE = {"d": {"start": 0.18, "stop": 0.26, "num": 5}, "accuracy": "0.1%"}
CYCLE = {"shape": "sine", "period": 1, "amplitude": 1}


def parts(quick: bool) -> list[Part]:
    """To and fro at two tolerances, and with a mean against a flow that is constant."""
    found = [
        _of(name, f"tol {tol:g}", scene, {**CYCLE, "mean": 0}, tol)
        for name, scene in (("pair", PAIR), ("three", THREE))
        for tol in TOLERANCES[: 1 if quick else 2]
    ]
    steady = {**THREE, "time": {"end": MEAN, "tol": TOLERANCES[-1]}}
    return [
        *(run.part for run in found),
        _of("three", "with a mean", THREE, {**CYCLE, "mean": MEAN}, TOLERANCES[-1]).part,
        Run(TOPIC, "three steady flow", steady, {"scene": "three"}, of_steady_flow).part,
        *([] if quick else [_travel()]),
    ]


def _of(scene: str, name: str, keys: Case, waveform: Case, tol: float) -> Run:
    case = {**keys, "waveform": waveform, "time": {"end": 1, "tol": tol}}
    return Run(TOPIC, f"{scene} {name}", case, {"scene": scene, "tol": tol, "flow_mean": waveform["mean"]})


def _travel() -> Part:
    """A pair in a cycle with a mean, against `travel` along its curve to the distance where the cycle ends."""
    run = _of("pair", "with a mean", PAIR, {**CYCLE, "mean": MEAN}, TOLERANCES[-1])
    curve = {key: value for key, value in PAIR.items() if key not in ("d0", "mesh", "output")} | CURVE
    identity = json.dumps([run.case, curve], sort_keys=True)
    return Part(run.part.name, identity, partial(_against_travel, run, curve))


def _against_travel(run: Run, keys: Case, folder: Path) -> Sequence[Row]:
    (row,) = run.part.compute(folder)
    if row["status"] != "finished":
        return [row]
    curve = computed("curve", keys, folder.with_name(f"{folder.name}-curve"), LIMIT)
    if curve.status != "finished":
        return [{**row, **how(curve)}]
    (start,), moved = [PAIR["d0"]], float(row["moved"] or 0.0)
    found = curve.travel(start, start + moved)
    return [{**row, "travel": found.time, "travel_error": found.time_error}]

"""Whether the drift at a held distance is that of a pair that is free, at its mean distance in the cycle."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from book.study import Part, Row, computed

from studies.pulses.runs import LIMIT, Case, how, of_cycles

CYCLES = 2


def part(name: str, case: Case, about: Row) -> Part:
    """A free run of some cycles, and one that is held at the mean distance of the last of them."""
    keys = {**case, "limits": {"drift": False}, "time": {**case["time"], "end": CYCLES * case["waveform"]["period"]}}
    return Part(f"held-{name}".replace(" ", "-"), json.dumps(keys, sort_keys=True), partial(_rows, name, keys, about))


def _rows(name: str, case: Case, about: Row, folder: Path) -> Sequence[Row]:
    free = computed("run", case, folder, LIMIT)
    row: Row = {"topic": "held", "run": name, **about, **how(free)}
    if free.status != "finished":
        return [row]
    distances, (of_free, *_) = of_last_cycle(free), of_cycles(free)
    there = {**case, "hold": True, "d0": float(f"{distances['d_mean']:.6g}")}
    held = computed("run", there, folder.with_name(f"{folder.name}-held"), LIMIT)
    if held.status != "finished":
        return [{**row, **how(held)}]
    (of_held, *_) = of_cycles(held)
    beside = {"held_mean": of_held["mean"], "held_half_width": of_held["half_width"]}
    return [{**row, **of_free, **distances, **beside}]


def of_last_cycle(result: Any) -> dict[str, float]:
    """Mean, least and largest distance of a pair in the last cycle of a run."""
    period, table = result.record["cycles"]["cycle"], result.table
    last = table[table["t"] > (CYCLES - 1) * period * (1 - 1e-9)]
    d, t = last["d"].to_numpy(), last["t"].to_numpy()
    return {"d_mean": float(np.trapezoid(d, t) / np.ptp(t)), "d_least": float(d.min()), "d_largest": float(d.max())}

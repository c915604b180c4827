"""Judge the ranges that `ask` gives by half-widths of its inputs: python tests/support/judge_ranges.py [COUNT].

Random experiments with half-widths of 2 to 20 % of some quantities, each asked at a random distance. 2,000 independent
draws of them are given to the atlas one by one; those outside of it count as outside of the range.
"""

from __future__ import annotations

import re
import sys
from typing import Any

import numpy as np
import pandas as pd

import pairsim
from pairsim.analysis.input_ranges import DrawnRange
from pairsim.atlas.atlas import PARAMETERS
from pairsim.lab.ask_atlas import asked_of
from pairsim.runtime.errors import InputError
from pairsim.solvers.curves.interpolant import hermite, slopes_of

DRAWS = 2000
UNITS = {
    "tube": "um",
    "particle": "um",
    "flow_rate": "ul/min",
    "viscosity": "Pa.s",
    "modulus": "kPa",
    "relaxation": "ms",
}


def experiment(random: np.random.Generator) -> tuple[dict[str, Any], dict[str, tuple[float, float]]]:
    """The arguments of `ask`, and the value and the half-width of each quantity; half of them are Giesekus liquids."""
    values = {"tube": 50.0, "flow_rate": 1.0, "viscosity": 1.0, "particle": 50 * random.uniform(0.31, 0.49)}
    values["modulus"] = 0.16976 / random.uniform(0.005, 0.095)  # Ca_e is as uniform
    if random.random() < 0.5:
        values["relaxation"] = 5.8905 * random.uniform(0.02, 0.95)
    uncertain = [name for name in values if random.random() < 0.5] or ["modulus"]
    known = {
        name: (value, value * random.uniform(0.02, 0.2) if name in uncertain else 0.0) for name, value in values.items()
    }
    texts = {
        name: f"{value:.6g} {f'+- {half:.4g} ' if half else ''}{UNITS[name]}" for name, (value, half) in known.items()
    }
    return texts | ({"liquid": "giesekus"} if "relaxation" in values else {}), known


def judge(count: int, seed: int = 0) -> pd.DataFrame:
    """A row for each experiment: the part of its draws that the range holds, and of those inside the atlas."""
    random, rows = np.random.default_rng(seed), list[dict[str, Any]]()
    while len(rows) < count:
        texts, known = experiment(random)
        try:
            answer = pairsim.ask(**texts)
        except InputError:  # such as beyond the largest Ca_e by rounding
            continue
        drawn = DrawnRange.of(answer.record)
        assert drawn is not None
        um = 50.0 * float(np.exp(random.uniform(np.log(0.022), np.log(1.8))))
        words = drawn.words(um / 50)
        least, largest = map(float, re.findall(r"[+-][\d.]+", words))
        q = {name: value + half / 2 * random.standard_normal(DRAWS) for name, (value, half) in known.items()}
        velocity = 4 * q["flow_rate"] / np.pi / q["tube"] ** 2 * 1e9 / 60 * 1e-6  # [m/s], of ul/min and um
        time = 1e-6 * q["tube"] / velocity
        numbers = (
            q["particle"] / q["tube"],
            1e-3 * q.get("relaxation", 0.0) / time,
            q["viscosity"] / time / 1e3 / q["modulus"],
        )
        places = np.stack([np.broadcast_to(each, DRAWS) for each in numbers], axis=1)
        atlas = asked_of(**texts)[0]
        low, high = np.array([atlas.box[name] for name in PARAMETERS]).T
        d = um / q["tube"]
        known_ = ((places >= low) & (places <= high)).all(axis=1) & (d >= atlas.d[0]) & (d <= atlas.d[-1])
        values, x = atlas.velocities(np.clip(places, low, high))[0], np.log(atlas.d)
        at = np.log(np.broadcast_to(np.clip(d, *atlas.d[[0, -1]]), DRAWS))
        dU = np.array([hermite(x, row, slopes_of(row, x))(here) for row, here in zip(values, at, strict=True)])
        held = (1e6 * velocity * dU >= least) & (1e6 * velocity * dU <= largest) & known_
        outside = 1 - known_.mean()
        row = {"held": held.mean(), "of_known": held[known_].mean(), "outside": outside}
        rows.append(row | {"range": words, "d": um, **texts})
    return pd.DataFrame(rows)


if __name__ == "__main__":
    found = judge(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
    print(found.describe().to_string())
    few = found[found["outside"] < 0.05]
    print(f"{len(few)} with less than 5 % of draws outside: {100 * few['held'].mean():.2f} % of draws in the range,")
    print(f"  {100 * few['held'].min():.1f} to {100 * few['held'].max():.1f} % by experiment")
    many = found[found["outside"] >= 0.05]
    print(f"{len(many)} with more: {100 * many['of_known'].mean():.2f} % of those inside the atlas")

"""Pulses: what a flow that varies in time does to pairs, beside slow limits, for docs/explanation/pulses.md.

scripts/pulses [PART ...]: computes the runs of some parts, of all by default, that are not in runs/pulses yet, and
writes docs/results/pulses/pulses.csv. Some ten minutes of processor time.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

import pairsim

ROOT = Path(__file__).resolve().parents[1]
OUT, RUNS = ROOT / "docs/results/pulses/pulses.csv", Path("runs/pulses")
COLUMNS = "part", "case", "period", "cycles", "drift/period", "half-width", "slow limit", "steps", "reason"
COARSE: dict[str, Any] = {"mesh": {"Np": 12, "max_size": 0.2}, "output": {"fields": False, "checkpoint": 1e9}}
COARSE |= {"beta": 0.4, "d0": 0.2, "length": 4, "accuracy": "5%", "hold": True}
SOFT = {**COARSE, "Ca_e": 0.05}
GIESEKUS = {**COARSE, "De": 1.0, "length": 6}
BENCH = {"tube": "60 um", "viscosity": "1 Pa.s", "particle": "24 um", "modulus": "5 kPa", "distance": "12 um"}


def steady(case: dict[str, Any], flow: float = 1.0) -> float:
    """dU in a steady flow at the distance of a case, on its cells; in a Newtonian liquid also at another flow."""
    own = {**case, "time": {"end": 4.0 + 8 * case.get("De", 0.0)}}
    if flow != 1.0:
        own["Ca_e"] *= abs(flow)
    name = f"steady-{own.get('De', 0):g}-{own['Ca_e']:.4g}-{own['beta']}"
    return abs(flow) * float(run_in(RUNS / name, own).table["dU"].iloc[-1])


def mean_of_steady(case: dict[str, Any], points: int = 6) -> float:
    """The same, over a sine of unit amplitude, by Gauss quadrature in a quarter of it."""
    x, w = np.polynomial.legendre.leggauss(points)
    return float(sum(w / 2 * [steady(case, float(np.sin(np.pi / 4 * (each + 1)))) for each in x]))


def run_in(folder: Path, case: dict[str, Any]) -> Any:
    """The result of a run, which is computed unless its folder has it."""
    if (folder / "run.json").exists() and pairsim.open(folder).status == "finished":
        return pairsim.open(folder)
    return pairsim.run(case, folder=folder, overwrite=True)


def run(part: str, name: str, case: dict[str, Any], limit: float | str = "") -> dict[str, Any]:
    """The row of a run."""
    result = run_in(RUNS / f"{part}-{name}".replace(" ", "-"), case)
    cycles = result.record.get("cycles") or {}
    cycle, drift = cycles.get("cycle", ""), cycles.get("drift", [np.nan])[0]
    row = [part, name, cycle, cycles.get("whole", ""), np.nan, np.nan, limit, result.record.get("steps"), result.reason]
    if cycles.get("whole"):
        row[4:6] = drift / cycle, cycles["drift_error"][0] / cycle
    return dict(zip(COLUMNS, row, strict=True))


def slow() -> Iterator[dict[str, Any]]:
    """A soft pair in a Newtonian liquid beside the limit of long periods."""
    limit = steady(SOFT)
    for period in (2, 8, 32, 320):
        wave = {"shape": "square", "period": period, "amplitude": 1}
        yield run("slow", f"square {period}", {**SOFT, "waveform": wave, "time": {"max_step": 20}}, limit)
    limit = mean_of_steady(SOFT)
    for period in (8, 32):
        yield run("slow", f"sine {period}", {**SOFT, "waveform": {"period": period, "amplitude": 1}}, limit)


def giesekus() -> Iterator[dict[str, Any]]:
    """Equal pairs in a Giesekus liquid, rigid and soft, over the period."""
    for Ca_e in (0.0, 0.05):
        case = {**GIESEKUS, "Ca_e": Ca_e}
        limit = steady(case)
        for period in (0.5, 2, 10):
            wave = {"shape": "square", "period": period, "amplitude": 1}
            yield run("Giesekus", f"Ca_e {Ca_e:g} period {period:g}", {**case, "waveform": wave}, limit)


def unequal() -> Iterator[dict[str, Any]]:
    """Beads that differ by 1 %: one direction against to and fro."""
    case = {**SOFT, "beta": [0.402, 0.398]}
    for period in (2, 8):
        wave = {"shape": "square", "period": period, "amplitude": 1}
        yield run("unequal", f"to and fro {period}", {**case, "waveform": wave}, steady(case))
    yield run("unequal", "equal beads", {**SOFT, "waveform": {"shape": "square", "period": 8, "amplitude": 1}})


def bench() -> Iterator[dict[str, Any]]:
    """A pump's log of a minute, and a ripple of 3 % at 10 Hz, at 2 ul/min in a tube of 60 um."""
    common = {key: COARSE[key] for key in ("mesh", "output", "length", "accuracy", "hold")}
    ripple = {"period": "100 ms", "mean": "2 ul/min", "amplitude": "0.06 ul/min"}
    yield run("bench", "ripple", {**common, "physical": BENCH, "waveform": ripple})
    random = Random(1)
    flows = [f"{2 + random.gauss(0, 0.1):.3f} ul/min" for _ in range(61)]
    log = {"shape": "table", "times": [f"{t} s" for t in range(61)], "flows": flows}
    yield run("bench", "log", {**common, "physical": BENCH, "waveform": log, "time": {"max_step": 50}})
    flat = {**ripple, "amplitude": "0.000001 ul/min"}
    yield run("bench", "flat", {**common, "physical": BENCH, "waveform": flat})


def random() -> Iterator[dict[str, Any]]:
    """Twenty random waveforms, liquids and solids: each ends with an answer or a reason."""
    draw = Random(86)
    laws: list[dict[str, Any]] = [{}, {"De": 0.5}, {"De": 0.3, "liquid": "oldroyd-b"}, {"De": 0.5, "liquid": "fene-p"}]
    laws[3]["liquid"] = {"law": "fene-p", "L2": 50}
    laws += [{"liquid": {"law": "carreau", "n": 0.6, "Cu": 2}}, {"liquid": {"law": "bingham", "Bn": 0.3}}]
    for k in range(20):
        period = 10 ** draw.uniform(-0.7, 0.7)
        shape = draw.choice(["sine", "square", "triangle", "ramp"])
        wave: dict[str, Any] = {"shape": shape, "period": period, "mean": draw.uniform(-1, 1), "amplitude": 1.0}
        if draw.random() < 0.2:
            times = [i * period / 6 for i in range(7)]
            wave = {"shape": "table", "times": times, "flows": [draw.uniform(-1, 1) for _ in times]}
        beta = [draw.uniform(0.25, 0.45), 0.4] if draw.random() < 0.5 else 0.4
        case = {**COARSE, **draw.choice(laws), "beta": beta, "Ca_e": draw.choice([0.0, 0.02, 0.05]), "waveform": wave}
        case |= {"mesh": {"Np": 8, "max_size": 0.25}, "hold": draw.random() < 0.5, "d0": draw.uniform(0.1, 0.5)}
        case |= {"time": {"end": 2 * period, "tol": 3e-3}, "start": draw.choice(["rest", "steady"])}
        yield run("random", f"{k}", case)


PARTS: dict[str, Callable[[], Iterator[dict[str, Any]]]] = {
    each.__name__: each for each in (slow, bench, unequal, giesekus, random)
}


def keep(row: dict[str, Any]) -> None:
    """Write a row into the table, in place of that of the same run."""
    written = {key: f"{value:.6g}" if isinstance(value, float) else str(value) for key, value in row.items()}
    rows: list[dict[str, Any]] = []
    if OUT.exists():
        with OUT.open(newline="") as file:
            rows = [old for old in csv.DictReader(file) if (old["part"], old["case"]) != (row["part"], row["case"])]
    with OUT.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows([*rows, written])


def main(names: list[str]) -> None:
    for name in names or PARTS:
        for row in PARTS[name]():
            said = (f"{each:.4g}" if isinstance(each, float) else str(each) for each in row.values())
            print("  ".join(said), flush=True)
            keep(row)


if __name__ == "__main__":
    main(sys.argv[1:])

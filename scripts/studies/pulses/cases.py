"""Pairs in flows that vary in time: the parts of the study, cheap ones first."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from book.study import Part, Row

from studies.pulses import exact, held, volume
from studies.pulses.runs import Case, Run, of_point, of_steady_flow, square

PAIR: dict[str, Any] = {"beta": 0.4, "d0": 0.2, "ends": "developed", "start": "rest", "output": {"fields": False}}
HELD: dict[str, Any] = {**PAIR, "hold": True, "limits": {"drift": False}}
CELLS = {"mesh": {"Np": 12, "max_size": 0.2}, "length": 4}
SOFT: dict[str, Any] = {**HELD, **CELLS, "De": 0, "Ca_e": 0.05, "accuracy": "5%"}
UNEQUAL = [0.402, 0.398]
SIZES = (0.1, 0.05, 0.025, 0.0125)
"""Cells of tubes without particles."""
QUADRATURE = 6  # points in a quarter of a sine

LEVELS: dict[str, dict[str, Any]] = {
    "coarse": {"accuracy": "5%", "mesh": {"Np": 20}, "time": {"tol": 1e-3}},
    "fine": {"accuracy": "1%", "mesh": {"Np": 28}, "time": {"tol": 1e-3}},
}
"""Cells of pairs in a Giesekus liquid, which are those of these accuracies, and time steps, which are the same."""
FIRST = 8  # parts of `giesekus` that come before cheaper ones
GIESEKUS: dict[str, Any] = {**HELD, "De": 1.0, "dU_error": True, "length": 6}
LONG, SHORT, SHORTEST = (10.0, 20.0, 2.0), 0.5, 0.1
"""Periods, of which short ones take many cycles to become periodic. At the shortest one the drift is below the
half-widths of both meshes: the coarse one has it alone."""
FADED = 6.0  # relaxation times after which the drift of a cycle is taken
LEAST_CYCLES = 2

BENCH = {"tube": "60 um", "viscosity": "1 Pa.s", "particle": "20 um", "modulus": "5 kPa", "distance": "12 um"}
LOGGED = 31  # flow rates of the log, a second apart
SEED = 86
LAWS: tuple[dict[str, Any], ...] = (
    {},
    {"De": 0.5},
    {"De": 0.3, "liquid": "oldroyd-b"},
    {"De": 0.5, "liquid": {"law": "fene-p", "L2": 50}},
    {"liquid": {"law": "carreau", "n": 0.6, "Cu": 2}},
    {"liquid": {"law": "bingham", "Bn": 0.3}},
)


def parts(quick: bool) -> list[Part]:
    """All parts, or a handful of cheap ones."""
    pipes = [exact.flow_without_particles(De, xi) for De in (1.0, 0.1) for xi in (0.09, 1e-4)]
    newtonian = [run.part for each in (tubes, rigid, slow, differing) for run in each(quick)]
    others = [run.part for each in (bench, slow_sine, at_random) for run in each(quick)]
    memory = giesekus(quick)
    found = [*pipes, *newtonian, *volume.parts(quick), *moving(quick), *memory[:FIRST], *others, *memory[FIRST:]]
    return found


def tubes(quick: bool) -> Iterator[Run]:
    """Oldroyd-B without particles, on finer and finer cells, and over some cycles with developed ends."""
    liquid = {"particles": 0, "De": 1.0, "xi": exact.XI, "liquid": "oldroyd-b", "waveform": exact.SINE}
    scenes = [(size, "periodic", 0.8, 3e-5) for size in (SIZES[:2] if quick else SIZES)]
    if not quick:
        scenes += [(0.0125, "periodic", 0.8, 2e-4), (0.05, "developed", 6.0, 2e-4)]
    for size, ends, end, tol in scenes:
        keys = {"length": 0.2, "ends": ends, "mesh": {"max_size": size}, "time": {"end": end, "tol": tol}}
        about: Row = {"size": size, "ends": ends, "end": end, "tol": tol}
        case = {**liquid, **keys, "output": {"times": [end]}}
        yield Run("tube", f"{ends} cells {size:g} tol {tol:g}", case, about, exact.of_run)


def rigid(quick: bool) -> Iterator[Run]:
    """Equal rigid spheres in a Newtonian liquid, which keep their distance."""
    case = {**PAIR, **CELLS, "De": 0, "Ca_e": 0, "time": {"end": 2, "tol": 1e-3}}
    for shape in ("sine", "square", "triangle"):
        yield Run("rigid", shape, {**case, "waveform": {"shape": shape, "period": 2, "amplitude": 1}})


def slow(quick: bool) -> Iterator[Run]:
    """A soft pair in a Newtonian liquid over the period, and the limit of long ones on the same cells."""
    yield from steady("slow", "square", SOFT)
    for period in (2, 8) if quick else (2, 8, 32, 400):
        case = {**SOFT, "waveform": square(period), "time": {"end": 2 * period, "max_step": 20}}
        yield Run("slow", f"square {period}", case, {"shape": "square", "period": period})


def slow_sine(quick: bool) -> Iterator[Run]:
    """The same in a sine, whose limit is a mean over a quarter of it."""
    nodes, weights = np.polynomial.legendre.leggauss(QUADRATURE)
    for node, weight in zip(np.sin(np.pi / 4 * (nodes + 1)).tolist(), weights.tolist(), strict=True):
        stiffer = {**SOFT, "Ca_e": float(f"{0.05 * node:.6g}")}
        about = {"shape": "sine", "factor": node, "weight": weight / 2}
        if not quick:
            yield from steady("slow", f"sine {node:.3g}", stiffer, **about)
    for period in () if quick else (8, 32):
        case = {**SOFT, "waveform": {"shape": "sine", "period": period, "amplitude": 1}, "time": {"end": 2 * period}}
        yield Run("slow", f"sine {period}", case, {"shape": "sine", "period": period})


def steady(topic: str, name: str, case: Case, end: float = 4.0, **about: Any) -> Iterator[Run]:
    """The same pair in a flow that does not vary."""
    keys = {key: value for key, value in case.items() if key != "limits"} | {"time": {"end": end}}
    yield Run(topic, f"{name} steady flow", keys, {"shape": name, "period": np.inf, **about}, of_steady_flow)


def differing(quick: bool) -> Iterator[Run]:
    """Beads that differ by 1 %: one direction against to and fro, beside equal ones of `slow`."""
    case = {**SOFT, "beta": UNEQUAL}
    yield from steady("differing", "one direction", case)
    for period in (2,) if quick else (2, 8):
        keys = {**case, "waveform": square(period), "time": {"end": 2 * period}}
        yield Run("differing", f"to and fro {period}", keys, {"shape": "square", "period": period})


def moving(quick: bool) -> list[Part]:
    """Pairs that differ, whose distance moves within a cycle: free, and held at their mean distance."""
    soft: dict[str, Any] = {**PAIR, **CELLS, "De": 0, "Ca_e": 0.05, "accuracy": "5%", "time": {"tol": 3e-4}}
    liquid: dict[str, Any] = {**soft, "De": 1.0, "Ca_e": 0, "length": 6, "time": {"tol": 1e-3}}
    scenes = {
        "1 %": {**soft, "beta": UNEQUAL, "waveform": square(8)},
        "3 %": {**soft, "beta": [0.406, 0.394], "waveform": square(8)},
        "3 % near": {**soft, "beta": [0.406, 0.394], "d0": 0.08, "waveform": square(4)},
        "10 % Giesekus": {**liquid, "beta": [0.42, 0.38], "waveform": square(2)},
    }
    chosen = list(scenes.items())[: 1 if quick else None]
    return [held.part(name, case, {"period": case["waveform"]["period"]}) for name, case in chosen]


def giesekus(quick: bool) -> list[Part]:
    """Equal pairs in a Giesekus liquid of De 1, rigid and soft, over the period, on two meshes."""
    found = [at_steady_flow(Ca_e).part for Ca_e in (0.0, 0.05)]
    if not quick:
        order = [(0.0, "coarse"), (0.0, "fine"), (0.05, "coarse"), (0.05, "fine")]
        found += [of_giesekus(*each, period).part for each in order for period in LONG]
        found.append(of_giesekus(0.0, "coarse", 2.0, length=12).part)
        found += [of_giesekus(*each, SHORT).part for each in order]
        found += [of_giesekus(Ca_e, "coarse", SHORTEST).part for Ca_e in (0.0, 0.05)]
    return found


def of_giesekus(Ca_e: float, level: str, period: float, length: float = 6.0) -> Run:
    """A pair over the cycles that it takes for the start to be forgotten."""
    cycles = max(LEAST_CYCLES, int(np.ceil(FADED / period)))
    case = {**GIESEKUS, **LEVELS[level], "Ca_e": Ca_e, "length": length, "waveform": square(period)}
    case |= {"time": {**LEVELS[level]["time"], "end": cycles * period}}
    case |= {"limits": {"drift": False, "max_steps": 100_000}}
    name = f"{beads(Ca_e)} period {period:g} {level}{' longer tube' if length > GIESEKUS['length'] else ''}"
    return Run("giesekus", name, case, {"period": period, "level": level, "Ca_e": Ca_e, "length": length})


def at_steady_flow(Ca_e: float) -> Run:
    """The same pair in a flow that does not vary."""
    case = {"beta": 0.4, "De": 1.0, "Ca_e": Ca_e, "d": [0.2], "ends": "developed", "accuracy": "0.5%"}
    about = {"period": np.inf, "Ca_e": Ca_e}
    return Run("giesekus", f"{beads(Ca_e)} steady flow", case, about, of_point, "curve")


def beads(Ca_e: float) -> str:
    """Beads in words."""
    return f"Ca_e {Ca_e:g}" if Ca_e else "rigid"


def bench(quick: bool) -> Iterator[Run]:
    """A pump's log of half a minute, and a ripple of 3 % at 10 Hz, at 2 ul/min in a tube of 60 um."""
    if quick:
        return
    common = {"physical": BENCH, "hold": True, "ends": "developed", "output": {"fields": False}}
    ripple = {"period": "100 ms", "mean": "2 ul/min", "amplitude": "0.06 ul/min"}
    steady_flow = {**common, "physical": {**BENCH, "flow_rate": "2 ul/min", "end": "20 ms"}}
    yield Run("bench", "constant", steady_flow, measure=of_steady_flow)
    yield Run("bench", "ripple", {**common, "waveform": ripple})
    log = {
        "shape": "table",
        "times": [f"{t} s" for t in range(LOGGED)],
        "flows": [f"{q:.3f} ul/min" for q in flows_of_log()],
    }
    yield Run("bench", "log", {**common, "waveform": log})


def flows_of_log() -> list[float]:
    """Flow rates at `LOGGED` times, with a scatter of 5 % about a mean over time of 2 [ul/min]."""
    draw = random.Random(1)
    flows = np.array([draw.gauss(0, 0.1) for _ in range(LOGGED)])
    return [round(flow, 3) for flow in (2 + flows - np.trapezoid(flows) / (LOGGED - 1)).tolist()]


def at_random(quick: bool) -> Iterator[Run]:
    """Twenty random waveforms, liquids and solids: each ends with an answer or a reason."""
    draw = random.Random(SEED)
    for k in range(2 if quick else 20):
        yield Run("random", f"{k:02d}", _drawn(draw))


def _drawn(draw: random.Random) -> Case:
    period = 10 ** draw.uniform(-0.7, 0.7)
    shape = draw.choice(["sine", "square", "triangle", "ramp"])
    wave: dict[str, Any] = {"shape": shape, "period": period, "mean": draw.uniform(-1, 1), "amplitude": 1.0}
    if draw.random() < 0.2:
        times = [i * period / 6 for i in range(7)]
        wave = {"shape": "table", "times": times, "flows": [draw.uniform(-1, 1) for _ in times]}
    beta: float | Sequence[float] = [draw.uniform(0.25, 0.45), 0.4] if draw.random() < 0.5 else 0.4
    case = {**PAIR, "length": 4, "accuracy": "5%", **draw.choice(LAWS), "beta": beta, "waveform": wave}
    case |= {"Ca_e": draw.choice([0.0, 0.02, 0.05]), "mesh": {"Np": 8, "max_size": 0.25}}
    case |= {"hold": draw.random() < 0.5, "d0": draw.uniform(0.1, 0.5), "start": draw.choice(["rest", "steady"])}
    return case | {"time": {"end": 2 * period, "tol": 3e-3}}

"""Flows without particles beside exact solutions: that of a run on its cells, and that of ends of tubes.

An Oldroyd-B liquid keeps its parabola, and dp/L = 32 [xi Q + (1 - xi) q] with De dq/dt + q = Q.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from book.study import Part, Row

from pairsim.physics.liquids.liquid import single
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.pulsating_pipe import PulsatingPipe
from pairsim.physics.waveform import Sine
from pairsim.record.xdmf import read_frame
from pairsim.runtime.arrays import Array

XI, PERIOD, MEAN = 0.09, 2.0, 0.2
SINE = {"shape": "sine", "period": PERIOD, "mean": MEAN, "amplitude": 1}
TIMES = np.linspace(0.1, 8.3, 83)


def flow(t: Array) -> Array:
    """The mean velocity over time."""
    return MEAN + np.sin(2 * np.pi / PERIOD * t)


def gradient(t: Array, De: float, xi: float = XI) -> Array:
    """The pressure drop over the length of the tube, from rest."""
    omega = 2 * np.pi / PERIOD
    k = De * omega
    periodic = (np.sin(omega * t) - k * np.cos(omega * t)) / (1 + k**2)
    q = MEAN * (1 - np.exp(-t / De)) + periodic + k / (1 + k**2) * np.exp(-t / De)
    return 32 * (xi * flow(t) + (1 - xi) * q)


def of_run(result: Any) -> Sequence[Row]:
    """Largest errors of a run: of its pressure drop, over the largest one, and of the profile at its end."""
    case, table = result.case, result.table
    exact = gradient(table["t"].to_numpy(), case.De)
    off = np.abs(table["dp"] / case.tube_length - exact).max() / np.abs(exact).max()
    frame = read_frame(result.folder)
    parabola = 2 * flow(np.array(frame.t)) * (1 - 4 * frame.points[:, 1] ** 2)
    profile = np.abs(frame.point_data["velocity"][:, 0] - parabola).max()
    return [{"pressure_error": float(off), "profile_error": float(profile)}]


def flow_without_particles(De: float, xi: float) -> Part:
    """The part of the flow that is integrated in the radius alone, as at the ends of tubes."""
    return Part(f"pipe-De-{De:g}-xi-{xi:g}", f"pipe {De} {xi} {SINE}", partial(_rows_of_flow, De, xi))


def _rows_of_flow(De: float, xi: float, _: Path) -> Sequence[Row]:
    pipe = PulsatingPipe(single(OldroydB(), De, xi), Sine(PERIOD, MEAN, 1.0))
    exact, flows = gradient(TIMES, De, xi), flow(TIMES)
    worst, profile = 0.0, 0.0
    for t, drop, mean in zip(TIMES.tolist(), exact.tolist(), flows.tolist(), strict=True):
        found = pipe(t)
        worst = max(worst, abs(found.gradient - drop))
        profile = max(profile, float(np.abs(found.u - 2 * mean * (1 - 4 * found.r**2)).max()))
    largest = float(np.abs(exact).max())
    about: Row = {"topic": "pipe", "run": f"De {De:g}, xi {xi:g}", "status": "finished"}
    return [{**about, "De": De, "xi": xi, "pressure_error": worst / largest, "profile_error": profile}]

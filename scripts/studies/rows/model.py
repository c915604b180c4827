"""The model of rows of beads that differ, followed in time."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import pairsim
from pairsim.questions.stream.computation import model_of
from pairsim.runtime.arrays import Array
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.rows.model import RowModel
from pairsim.solvers.rows.stream_motion import follow

PLACES = 600  # lengths of tube at which rows are looked at, from which what is between is interpolated


@dataclass(frozen=True)
class Paths:
    """The distances of a row over time.

    Attributes:
        t: Times [D_c/U_av], shape (m,).
        d: Distances [D_c], shape (m, N-1).
        widths: Their half-widths, likewise.
    """

    t: Array
    d: Array
    widths: Array

    def near(self, gap: int, d: float) -> float | None:
        """When a distance falls to a value at first; None if it does not."""
        below = self.d[:, gap] <= d
        if not below.any():
            return None
        i = int(np.argmax(below))
        return float(np.interp(-d, -self.d[[i - 1, i], gap], self.t[[i - 1, i]])) if i else 0.0


def followed(
    keys: Mapping[str, Any], most: int, betas: Array, gaps: Array, contact: float, end: float
) -> tuple[Paths, float]:
    """The distances of a row by the model, and the processor time that it took [s].

    Their half-widths are by how much they change by other models (`RowModel.variants`), and what the errors of short
    rows nearby add up to.

    Args:
        keys: Those of a case of equal beads.
        most: Beads of the longest short rows.
        betas: Diameters of the beads [D_c].
        gaps: Their first distances [D_c].
        contact: Distance at which they touch [D_c].
        end: Time at the end [D_c/U_av].
    """
    begin = time.process_time()
    differ = {"spread": {"diameter": 0.05}}  # any: so that what each bead changes is known
    case = pairsim.load({**keys, "d": 1.0, **differ, "stream": {"neighbours": most}}, kind="stream")
    model = model_of(case, Monitor())
    parts = np.column_stack([np.log(betas / case.betas[0]), np.zeros(len(betas))])
    t, d = _path(model, gaps, parts, contact, end)
    changes = [_at(t, *_path(other, gaps, parts, contact, end)) - d for other in model.variants]
    errors = np.array([model.dU_error_nearby(row) for row in d])
    of_rows = np.append(0.0, np.cumsum(np.diff(t) * (errors[1:] + errors[:-1]) / 2))
    widths = np.hypot(np.linalg.norm(changes, axis=0), of_rows[:, None])
    return Paths(t, d, widths), time.process_time() - begin


def _path(model: RowModel, gaps: Array, parts: Array, contact: float, end: float) -> tuple[Array, Array]:
    """Times and distances of a row by a model."""
    length = 1.05 * end * float(model.alone[0] + model.alone[2])
    found = list(follow(model, gaps, parts, contact, np.linspace(0.0, length, PLACES).tolist(), Monitor()))
    return np.array([each.time for each in found]), np.array([each.gaps for each in found])


def _at(times: Array, t: Array, d: Array) -> Array:
    """Distances at times."""
    return np.column_stack([np.interp(times, t, each) for each in d.T])

"""Rows of beads whose diameters and distances are drawn: the parts of the study.

Each row is followed by `pairsim run` in full, and by the model of rows that moves streams. The diameters and distances
of a row are drawn with one seed, which was chosen before anything was computed, and are the same in all materials.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from book.study import Part, Row, computed

from pairsim.runtime.arrays import Array
from studies.rows.model import Paths, followed

SEED = 85
BETA, DISTANCES = 0.4, (0.06, 0.2)  # mean diameter [D_c]; range of the first distances, evenly in their logarithm [D_c]
MATERIALS: dict[str, dict[str, float]] = {"soft": {"De": 0.0, "Ca_e": 0.1}, "De 1": {"De": 1.0, "Ca_e": 0.0}}
"""Soft beads in a Newtonian liquid, and rigid ones in a viscoelastic one."""
ENDS = {2: 25.0, 5: 10.0}  # time by which runs end, by the spread in per cent [D_c/U_av]
LATER = 1.5  # time by which the model ends over that of the run, so that the end does not decide on the order
TIMES = 10  # at which distances are compared
CONTACT = 0.005  # distance at which runs end, and particles of the model touch [D_c]
NEAR = 0.02  # distance that counts as near [D_c]
MODELS = (3,)  # beads of the longest short rows of which the model is made
LIMIT = 7200.0  # wall time of a run [s]
OF_RUNS = (
    "pairsim.physics",
    "pairsim.fem",
    *(f"pairsim.solvers.{package}" for package in ("errors", "nonlinear", "steady", "stepping", "transient")),
    *(f"pairsim.solvers.{module}" for module in ("goals", "mesh_transfer", "meshed_scene", "problems", "solution")),
    "pairsim.cases.accuracy",
    "pairsim.computing.problems",
    "pairsim.computing.accuracy",
)
"""Code that runs depend on."""
OF_MODELS = (
    *OF_RUNS[:2],
    *(f"pairsim.solvers.{package}" for package in ("curves", "errors", "nonlinear", "rows", "steady", "trains")),
    *(f"pairsim.solvers.{module}" for module in ("goals", "mesh_transfer", "meshed_scene", "parameters")),
    *(f"pairsim.solvers.{module}" for module in ("problems", "solution")),
    *OF_RUNS[-3:],
)
"""Code that the model of rows depends on."""


@dataclass(frozen=True)
class Drawn:
    """A row that was drawn.

    Attributes:
        material: One of `MATERIALS`.
        beads: Their number.
        spread: Standard deviation of their diameters [per cent].
    """

    material: str
    beads: int
    spread: int

    @property
    def name(self) -> str:
        """Such as "5 beads, 2 %, soft"."""
        return f"{self.beads} beads, {self.spread} %, {self.material}"

    @property
    def drawn(self) -> tuple[list[float], list[float]]:
        """Diameters and first distances [D_c]."""
        random = np.random.default_rng([SEED, self.beads, self.spread])
        parts = np.clip(random.standard_normal(self.beads), -3, 3) * self.spread / 100
        low, high = DISTANCES
        gaps = low * (high / low) ** random.random(self.beads - 1)
        return [float(f"{BETA * (1 + part):.4g}") for part in parts], [float(f"{d:.3g}") for d in gaps]

    @property
    def times(self) -> Array:
        """Those at which distances are compared [D_c/U_av]."""
        return np.linspace(0.0, ENDS[self.spread], TIMES + 1)[1:]

    def case(self, accuracy: str) -> dict[str, Any]:
        """The case of its run."""
        betas, gaps = self.drawn
        return {
            **{"particles": self.beads, "beta": betas, "d0": gaps, **MATERIALS[self.material]},
            **{"start": "steady", "accuracy": accuracy, "dU_error": True, "limits": {"min_gap": CONTACT}},
            **{"time": {"end": ENDS[self.spread]}, "output": {"times": self.times.tolist(), "fields": False}},
        }


ROWS = [Drawn(material, beads, spread) for beads in (5, 8) for spread in (2, 5) for material in MATERIALS]
# Computed after the model was mended: by the above, by how shapes lag behind, and by which bead a film slows down.
ROWS += [Drawn(material, beads, 5) for beads in (6, 7, 9) for material in MATERIALS]
ACCURACY, COARSE = "1%", "5%"


def parts(quick: bool) -> list[Part]:
    """All parts: the runs, then the models; or one row of five, on coarse cells."""
    rows, accuracy = (ROWS[:1], COARSE) if quick else (ROWS, ACCURACY)
    models = MODELS[:1] if quick else MODELS
    found = [_part(row, "run", row.case(accuracy), OF_RUNS, partial(_run, row, row.case(accuracy))) for row in rows]
    for row, most in product(rows, models):
        case = {**row.case(accuracy), "neighbours": most}
        found.append(_part(row, f"rows of {most}", case, OF_MODELS, partial(_model, row, most, accuracy)))
    return found


def _part(row: Drawn, by: str, case: dict[str, Any], uses: Sequence[str], compute: Any) -> Part:
    return Part(f"{row.name}, {by}", json.dumps({"by": by, **case}, sort_keys=True), compute, tuple(uses))


def _run(row: Drawn, case: dict[str, Any], folder: Path) -> list[Row]:
    """The rows of a run."""
    result = computed("run", case, folder, LIMIT)
    table, names = result.table, [f"{i}" for i in range(1, row.beads)]
    t = table["t"].to_numpy()
    d = table[[f"d_{name}" for name in names]].to_numpy()
    errors = table[[f"dU_error_{name}" for name in names]].to_numpy()
    # That of a distance is what dU may be off, summed over time: the start is as given.
    steps = np.diff(t)[:, None] * (errors[1:] + errors[:-1]) / 2
    widths = np.vstack([np.zeros(row.beads - 1), np.cumsum(steps, axis=0)])
    return _rows(row, "run", Paths(t, d, widths), result.reason or result.status, result.record.wall_time or 0.0)


def _model(row: Drawn, most: int, accuracy: str, _: Path) -> list[Row]:
    """The rows of the model of rows of up to so many beads."""
    betas, gaps = row.drawn
    keys = {"beta": BETA, **MATERIALS[row.material], "accuracy": accuracy}
    paths, seconds = followed(keys, most, np.array(betas), np.array(gaps), CONTACT, LATER * ENDS[row.spread])
    return _rows(row, f"rows of {most}", paths, "end", seconds)


def _rows(row: Drawn, by: str, paths: Paths, ended: str, seconds: float) -> list[Row]:
    """One for each time and gap, and one for each gap that comes near."""
    start: Row = {"material": row.material, "beads": row.beads, "spread": row.spread, "by": by}
    more: Row = {"ended": ended, "seconds": seconds}
    found = list[Row]()
    for i in range(row.beads - 1):
        times = row.times[row.times <= paths.t[-1]]
        d, widths = (np.interp(times, paths.t, each[:, i]) for each in (paths.d, paths.widths))
        values = zip(times, d, widths, strict=True)
        found += [{**start, "gap": i + 1, "t": t, "d": d, "half_width": w, "near": None, **more} for t, d, w in values]
        if (near := paths.near(i, NEAR)) is not None:
            found.append({**start, "gap": i + 1, "t": None, "d": NEAR, "half_width": None, "near": near, **more})
    return found

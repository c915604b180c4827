"""Rows of a run, and their extreme values, from which its warnings are made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pairsim.config.case import Case
from pairsim.config.checked_range import beyond_checked
from pairsim.drivers.warnings import (
    coarse_mesh,
    large_run_error,
    long_steps,
    narrow_gap,
    near_ends,
    unknown_run_error,
    unresolved_stress,
)
from pairsim.results.columns import gap_endings, named_row, observed, spread
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.run_error import RunError
from pairsim.solvers.errors.time_error import LEAST, SET_IN, TimeError
from pairsim.solvers.stepping.step import Step


def row_of(step: Step) -> dict[str, float]:
    """The row of a step in series.csv, but for the errors to quote."""
    o, correction = step.observation, step.U_correction
    U = o.U if correction is None else o.U + np.nan_to_num(correction)
    row = named_row(step.t, o.d, U, np.diff(U), o.D, o.dp, o.dp_plus)
    row |= {"dt": step.dt, "newton": step.report.iterations, "mesh": step.mesh_id}
    row |= {**observed(o), "distortion": step.distortion}
    if correction is not None:
        row |= spread(gap_endings(o.U.size), dU_discrete=o.dU, dU_correction=np.diff(correction))
    return row


@dataclass
class RunWarnings:
    """Extreme values over a run, from which its warnings are made.

    Attributes:
        case: The case.
        s_jump: Largest change of s = log c within a cell.
        widest: Largest length of the row of particles [D_c].
        narrowest: Gap and length of the adjacent arcs [D_c] when their ratio was smallest.
        steps: Estimate of the error of dU due to the time steps.
        errors: Errors of dU to quote.
        largest: The largest of them after stresses have set in [U_av].
        lost: Time from which they are unknown, since their estimate diverged; infinite if it did not.
    """

    case: Case
    s_jump: float = 0.0
    widest: float = 0.0
    narrowest: tuple[float, float] = (1.0, 0.0)
    steps: TimeError = field(init=False)
    errors: RunError = field(init=False)
    largest: float = 0.0
    lost: float = np.inf

    def __post_init__(self) -> None:
        self.steps = TimeError(order=2 if self.case.liquid_model.modes else 3)
        self.errors = RunError(self.case.liquid_model.longest)

    @staticmethod
    def of(
        case: Case, rows: Mapping[str, Array], narrowest: tuple[float, float], start_error: Array | float = 0.0
    ) -> RunWarnings:
        """The values for the rows of an existing series.csv.

        Args:
            case: The case.
            rows: Columns of series.csv, shape (rows,).
            narrowest: As the attribute; not in the table.
            start_error: Error of dU in the state that the run started from, not in the table either.
        """
        worst = RunWarnings(case, narrowest=narrowest)
        worst.errors.start = start_error
        for values in zip(*rows.values(), strict=True):
            worst.take(dict(zip(rows, map(float, values), strict=True)))
        return worst

    def take(self, row: Mapping[str, float]) -> dict[str, float]:
        """Take in a row of series.csv; returns the errors of dU to quote by their columns, empty without estimates."""
        t, mesh, gaps = row["t"], int(row["mesh"]), gap_endings(self.case.n)
        discrete = "dU_discrete" if self.case.estimates_error else "dU"
        d, dU = (np.array([row[name + gap] for gap in gaps]) for name in ("d", discrete))
        self.s_jump = max(self.s_jump, row.get("s_jump", 0.0))
        self.widest = max(self.widest, sum(self.case.betas) + float(d.sum()))
        self.steps.add(t, mesh, dU)
        if not self.case.estimates_error:
            return {}
        corrections = np.array([row[f"dU_correction{gap}"] for gap in gaps])
        error = self.errors.add(t, mesh, dU, corrections, self.steps.largest, row.get("s_jump", 0.0))
        if np.isnan(error).any():
            self.lost = min(self.lost, t)
        elif t > SET_IN:
            self.largest = max(self.largest, float(error.max(initial=0.0)))
        return spread(gaps, dU_error=error)

    @property
    def warnings(self) -> list[str]:
        """Warnings about the results."""
        stress, narrow = unresolved_stress(self.case, self.s_jump), narrow_gap(self.case, *self.narrowest)
        steps, ends = long_steps(self.case, self.steps.part), near_ends(self.case, self.widest)
        # Where dU is nothing but errors, as for equal rigid particles, a part of it means nothing.
        part = self.largest / self.steps.peak if self.steps.peak > LEAST else 0.0
        error = [*large_run_error(self.case, part), *unknown_run_error(self.case, self.lost)]
        return [*beyond_checked(self.case), *coarse_mesh(self.case), *steps, *error, *stress, *narrow, *ends]

"""Extreme values over a run, from which its warnings are made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

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
from pairsim.results.columns import relative_velocities
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.run_error import RunError
from pairsim.solvers.errors.time_error import LEAST, SET_IN, TimeError


def span(case: Case, gaps: Sequence[Any]) -> float:
    """Largest length of the row of particles [D_c] for these gaps, each a number or an array over time."""
    return sum(case.betas) + float(np.max(np.sum(gaps, axis=0), initial=0.0) if len(gaps) else 0.0)


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
        case: Case, series: Mapping[str, Array], narrowest: tuple[float, float], start_error: Array | float = 0.0
    ) -> RunWarnings:
        """The values for the rows of an existing series.csv.

        Args:
            case: The case.
            series: Columns of series.csv, shape (rows,).
            narrowest: As the attribute; not in the table.
            start_error: Error of dU in the state that the run started from, not in the table either.
        """
        gaps = [series[name] for name in series if name == "d" or name.startswith("d_")]
        s_jump = float(np.max(series.get("s_jump", [0.0]), initial=0.0))
        worst = RunWarnings(case, s_jump, span(case, gaps), narrowest)
        worst.errors.start = start_error
        rows = len(series["t"])

        def table(names: list[str]) -> Array:
            return np.array([series[name] for name in names]).reshape(len(names), rows).T

        estimated = [name for name in series if name.startswith("dU_correction")]
        relative, corrections = table(relative_velocities(series)), table(estimated)
        for i, (t, mesh) in enumerate(zip(series["t"], series["mesh"], strict=True)):
            worst.add(float(t), int(mesh), relative[i], corrections[i] if estimated else None)
        return worst

    def add(self, t: float, mesh: int, dU: Array, correction: Array | None) -> Array | None:
        """Take in an accepted step.

        Args:
            t: Time [D_c/U_av].
            mesh: Number of remeshings before the step.
            dU: Relative velocities [U_av], shape (N-1,).
            correction: Estimates of exact minus discrete dU [U_av], shape (N-1,); None if there are none.

        Returns:
            The errors of dU to quote [U_av], shape (N-1,); None without estimates.
        """
        self.steps.add(t, mesh, dU)
        if correction is None:
            return None
        error = self.errors.add(t, mesh, dU, correction, self.steps.largest)
        if np.isnan(error).any():
            self.lost = min(self.lost, t)
        elif t > SET_IN:
            self.largest = max(self.largest, float(error.max(initial=0.0)))
        return error

    @property
    def warnings(self) -> list[str]:
        """Warnings about the results."""
        stress, narrow = unresolved_stress(self.case, self.s_jump), narrow_gap(*self.narrowest)
        steps, ends = long_steps(self.case, self.steps.part), near_ends(self.case, self.widest)
        # Where dU is nothing but errors, as for equal rigid particles, a part of it means nothing.
        part = self.largest / self.steps.peak if self.steps.peak > LEAST else 0.0
        error = [*large_run_error(self.case, part), *unknown_run_error(self.lost)]
        return [*beyond_checked(self.case), *coarse_mesh(self.case), *steps, *error, *stress, *narrow, *ends]

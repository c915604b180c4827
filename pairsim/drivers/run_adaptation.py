"""Cells of a run that follow from `accuracy`: a coarse run tells how small they must be."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from pairsim.config.case import Case
from pairsim.drivers.run_warnings import RunWarnings, row_of
from pairsim.drivers.warnings import above
from pairsim.runtime.errors import RunFailure
from pairsim.solvers.errors.time_error import LEAST
from pairsim.solvers.problems import Problem
from pairsim.solvers.transient.transient import Transient

# Factors of the coarse run's cells and of its tolerance over those that `accuracy` sets, and its fewest cells on a
# half-circle; chosen.
COARSE, COARSE_TOLERANCE, FEWEST = 2.0, 4.0, 14
# Order of dU_error in the cell size; measured (docs/explanation/decisions.md).
ORDER = 3.0
# Part of the error allowed that cells are made for, and bounds on the factor of the cells over those that `accuracy`
# sets; chosen.
AIM, FACTORS = 0.8, (0.4, COARSE)
# Part of dU_error that is due to the cells even where the coarse run's time steps seem to cause all of it; chosen.
LEAST_PART = 0.1


@dataclass(frozen=True)
class RunAdaptation:
    """What a coarse run tells of the cells that a run needs.

    Attributes:
        wanted: Error wanted, as a part of the largest |dU|.
        dU: Largest |dU| of the coarse run [U_av].
        error: Its largest dU_error [U_av].
        t: Time that it reached [D_c/U_av].
        unknowns: Its unknowns.
        factor: Factor of the run's cells over those that `accuracy` sets.
    """

    wanted: float
    dU: float
    error: float
    t: float
    unknowns: int
    factor: float

    @classmethod
    def begin(
        cls, case: Case, problem: Problem, ended: Callable[[float, Sequence[float]], bool]
    ) -> RunAdaptation | None:
        """Compute the coarse run; None if it has no dU to which an error could be compared.

        Args:
            case: The case.
            problem: Its problem.
            ended: Whether a run ends at a time and distances.

        Raises:
            Stopped: The process has received a signal.
        """
        seen, t, unknowns = RunWarnings(case), 0.0, 0
        control = replace(problem.control, tolerance=COARSE_TOLERANCE * problem.control.tolerance)
        coarse = replace(problem, mesh=problem.mesh.scaled(COARSE, FEWEST), control=control)
        transient: Transient | None = None
        try:
            with suppress(RunFailure):  # finer cells may go on where coarse ones fail
                transient = Transient(coarse)
                seen.errors.start = transient.state.start_error
                unknowns = transient.constraints.size
                for step in transient.steps(iter([case.time.end])):
                    problem.monitor.check_signals()
                    seen.take(row_of(step))
                    t = step.t
                    if ended(t, step.observation.d.tolist()):
                        break
        finally:
            if transient is not None:
                transient.close()
        peak, wanted = seen.steps.peak, case.error_wanted
        if peak <= LEAST or not seen.largest:
            return None
        by_cells = max(seen.largest - seen.steps.largest, LEAST_PART * seen.largest)
        factor = COARSE * (AIM * wanted * peak / by_cells) ** (1 / ORDER)
        factor = min(max(factor, FACTORS[0]), FACTORS[1])
        return cls(wanted, peak, seen.largest, t, unknowns, float(f"{factor:.3g}"))

    def adapted(self, problem: Problem) -> Problem:
        """The problem with the cells of the run."""
        return replace(problem, mesh=problem.mesh.scaled(self.factor, FEWEST))

    @property
    def entry(self) -> dict[str, Any]:
        """The part of the entry of run.json that is known before the run."""
        coarse = {"t": self.t, "unknowns": self.unknowns, "dU": self.dU, "dU_error": self.error}
        return {"wanted": self.wanted, "cells": self.factor, "coarse_run": coarse}


def outcome_of(seen: RunWarnings) -> tuple[dict[str, Any], str]:
    """The part of the entry of run.json that is known after the run, and what the closing line says of it."""
    peak, wanted = seen.steps.peak, seen.case.error_wanted
    if peak <= LEAST:
        return {"kept": True}, ""
    if math.isfinite(seen.lost):
        return {"kept": False}, f"; accuracy: {seen.case.accuracy} was not kept, dU_error is not known"
    reached = seen.largest / peak
    entry = {"reached": reached, "kept": reached <= wanted, "reference_dU": peak}
    kept = "kept" if reached <= wanted else "not kept"
    percent = f"{100 * reached:.2g}" if reached <= wanted else above(100 * reached, 100 * wanted)
    return entry, f"; accuracy: {seen.case.accuracy} was {kept}, dU_error is up to {percent} %"

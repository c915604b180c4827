"""Compute one case in time.

Writes series.csv, fields.xdmf, case.yaml, run.json and checkpoint.npz.
Lengths are in tube diameters D_c, velocities in the mean velocity U_av, times
in D_c/U_av.

Exit codes: 0 finished (also at contact or max_gap), 2 wrong input, 3
computation failed, 4 installation or system at fault (pairsim doctor), 130
interrupted.
"""

from __future__ import annotations

import math
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from pairsim.cases.estimate import Estimate
from pairsim.cases.off_axis import points_off_axis
from pairsim.cases.run_case import Case
from pairsim.computing import events
from pairsim.computing.off_axis.columns import NAME, TABLE
from pairsim.computing.off_axis.lines import lines_beside
from pairsim.computing.question import Flag, InSweeps, Question, last_row
from pairsim.computing.result import Result
from pairsim.record.column import names_of
from pairsim.record.columns import (
    CYCLE_COLUMNS,
    DISTANCE,
    DP,
    DU,
    DU_ERROR,
    SERIES_COLUMNS,
    STEPS,
    TAYLOR,
    Q,
    T,
    U,
    Z,
)
from pairsim.record.folder import CHECKPOINT
from pairsim.record.run_entries import OF_RUNS
from pairsim.runtime.text import pasteable

if TYPE_CHECKING:
    from pairsim.analysis.time_series import Series
    from pairsim.plots.style import Page
    from pairsim.runtime.monitor import Monitor


def estimate(case: Case, runs: int = 1) -> Estimate:
    """Size and duration of a run in time, or of `runs` such runs."""
    polymer = bool(case.liquid_model.modes)
    end, first = case.time.end, case.time.first_step
    if case.time.fixed_step is not None:
        steps = end / case.time.fixed_step
    else:
        pace = (3e-4 / case.time.tol) ** 0.45 if any(case.Ca_es) or polymer else 0.25
        starts = 10 * pace * math.log(1 + end / first) * (3 if polymer else 1)
        steps = starts + end / case.time.max_step
        if (flow := case.flow_over_time) is not None:
            # Sixty steps per cycle, and twenty after each kink; in eight runs this was right within a factor of two.
            cycles = end / flow.cycle if flow.period is not None else min(end / flow.cycle, 1.0)
            steps += pace * cycles * (60 + 20 * flow.kinks) * (3 if polymer else 1)
    adapted = "; the mesh is adapted: how many the run needs is known after a coarse run" if case.adapts else ""
    return Estimate.of(case, runs * steps + points_off_axis(case), adapted)


def solve(case: Case, *, monitor: Monitor, earlier: events.Earlier | None = None) -> events.Events:
    """Integrate a case in time, from its start or from where an earlier run stopped."""
    from pairsim.questions.run.computation import Run

    return Run(case, monitor, earlier).computation()


def result_columns(case: Case) -> tuple[str, ...]:
    """Result columns of a run: those of the last row of series.csv, and the number of steps."""
    flow = () if case.waveform is None else (Q, *CYCLE_COLUMNS)
    return tuple(names_of(case.n, T, Z, DISTANCE, DU, DU_ERROR, *flow, U, TAYLOR, DP, STEPS))


class RunResult(Result):
    """The result of a run in time. `table` is series.csv, with a row for each accepted step."""

    @cached_property
    def series(self) -> Series:
        """What the particles do over time: distances, velocities, and whether the start-up has decayed."""
        from pairsim.analysis.time_series import Series  # loads numpy

        return Series(self.tables["series"], self.record)

    def findings(self) -> list[str]:
        """What the particles do at the end."""
        from pairsim.questions.run.answer import answer_of_run

        if not self.series.table.rows:
            return ["No step was completed."]
        return [*answer_of_run(self.series), *lines_beside(self.tables, self.record)]

    def afterwards(self) -> str:
        folder = pasteable(self._place)
        drawn = f"pairsim plot {folder} draws it"
        if self.reason == "contact" or not (self._place / CHECKPOINT).is_file():
            return drawn
        end = "time.end" if self.record.scales is None else "physical.end"
        further = {"max_gap": "limits.max_gap=...", "periodic": "limits.drift=false"}.get(self.reason, f"{end}=...")
        return f"{drawn}; pairsim run --resume {folder} --set {further} continues"


def draw(folder: Path, out: Path, page: Page) -> list[Path]:
    """Draw the tables of a folder."""
    from pairsim.plots.runs_and_curves import draw_run

    return draw_run(folder, out, page)


QUESTION = Question(
    __name__,
    model=Case,
    estimate=estimate,
    solve=solve,
    tables={"series": SERIES_COLUMNS, NAME: TABLE},
    entries=OF_RUNS,
    result=RunResult,
    in_sweeps=InSweeps(result_columns, last_row, parameters=("beta", "De", "Ca_e", "d0"), drawn=True),
    draw=draw,
    captions={"series": "Velocities and shapes over time, relative velocity over distance"},
    frames="t",
    flags=(
        Flag(
            "resume",
            "Continue the run in this folder from its checkpoint. "
            "A case file or --set may change name, time.end, limits and output.",
            resumes=True,
        ),
    ),
    draws_from=None,
    examples="Examples: pairsim run configs/quickstart.yaml | pairsim run case.yaml -o out --set Ca_e=0.05 | "
    "pairsim run --resume out --set time.end=4",
)

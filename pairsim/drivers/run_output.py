"""Write the rows, fields and checkpoints of a run as it advances, and collect its warnings."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import pairwise
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
from pairsim.results.checkpoint import Checkpoint
from pairsim.results.columns import (
    HEALTH,
    POLYMER_HEALTH,
    error_columns,
    named_row,
    observed,
    relative_velocities,
    series_columns,
)
from pairsim.results.fields import frame
from pairsim.results.fields_writer import FieldsWriter, gather_frames
from pairsim.results.output import SERIES, RunFolder, SeriesWriter, plain, read_series
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.run_error import RunError
from pairsim.solvers.errors.time_error import LEAST, SET_IN, TimeError
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.transient.transient import Transient

CHEAP = 50.0  # least interval between checkpoints at output times, over the wall time of writing one


def milestones(case: Case) -> list[float]:
    """Times that steps must land on: the output times and the end time, ascending."""
    end, every = case.time.end, case.output.every
    times = {t for t in case.output.times if 0 < t < end}
    if every is not None:
        times |= {k * every for k in range(1, int(np.ceil(end / every - 1e-9)))}
    return [*sorted(times), end]


def passes_frame(case: Case, t: float, dt: float) -> bool:
    """Whether a step passes one of the `output.frames` times, which are spread evenly up to the end.

    Unlike `milestones` they cost no steps. Where a run was stopped makes no difference to them.

    Args:
        case: The case.
        t: End of the step.
        dt: Its size.
    """
    output = case.output
    if output.times or output.every is not None:
        return False
    rate = output.frames / case.time.end
    return int(t * rate) > int((t - dt) * rate)


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


class RunOutput:
    """Writes series.csv, fields and checkpoints of a run.

    Args:
        case: The case.
        folder: Folder for the results.
        old: The checkpoint to resume from; rows and fields written after it are removed. None: start at t = 0.

    Raises:
        InputError: series.csv does not fit the checkpoint.
        OSError: The files cannot be written.
    """

    def __init__(self, case: Case, folder: RunFolder, old: Checkpoint | None) -> None:
        self.case, self.folder, self.old = case, folder, old
        errors = error_columns(case.n) if case.estimates_error else []
        columns = [*series_columns(case.n), *errors, *HEALTH, *(POLYMER_HEALTH if case.liquid_model.modes else ())]
        self.series = SeriesWriter(folder.file(SERIES), columns, old.rows if old else None, errors)
        keep, until = (old.frames, old.state.history.t[0]) if old else (0, 0.0)
        self.fields = FieldsWriter(folder.path, keep, until) if case.output.fields else None
        lost = keep - self.fields.frames if self.fields else 0
        self.damage = [f"{lost} frames of fields.xdmf could not be read and are lost"] if lost else []
        self.worst = RunWarnings(case)
        if old is not None:
            rows = read_series(folder.file(SERIES))
            self.worst = RunWarnings.of(case, rows, old.narrowest, old.state.start_error)
        self.wanted = milestones(case)
        self._pending: Step | None = None
        self._latest: Checkpoint | None = None
        self._saved, self._cost = -np.inf, 0.0

    @property
    def warnings(self) -> list[str]:
        """Warnings about the results."""
        return [*self.damage, *self.worst.warnings]

    def attach(self, transient: Transient) -> None:
        """Set the solver whose steps will be written; call it before `take`."""
        self.transient, self.pipe = transient, transient.pipe
        self.worst.errors.start = transient.state.start_error
        self.origin = self.old.origin if self.old is not None else transient.history.h[0]

    def take(self, step: Step, wall: float) -> None:
        """Write an accepted step, and a checkpoint if one is due.

        Args:
            step: The step.
            wall: Wall time of the run so far [s].

        Raises:
            OSError: A file cannot be written.
        """
        self._row(step)
        at_output = any(abs(step.t - t) <= 1e-9 * max(1.0, t) for t in self.wanted)
        self._pending = step
        if at_output or self.transient.counts.steps == 1 or passes_frame(self.case, step.t, step.dt):
            self._field()
        # Fields of the last step are not counted: a resumed run with another end time has none at this time.
        frames = self.fields.frames if self.fields is not None else self.old.frames if self.old else 0
        gaps = tuple(map(float, step.observation.d))
        state, case = self.transient.state, plain(self.case.resolved())
        self._latest = Checkpoint(state, case, gaps, self.worst.narrowest, self.origin, self.series.rows, frames, wall)
        passed = time.monotonic() - self._saved
        if passed >= self.case.output.checkpoint or (at_output and passed > CHEAP * self._cost):
            self._save()

    def finish(self, last_frame: bool, ended: bool) -> None:
        """Write the checkpoint of the last step and, with `last_frame`, its fields; close all files.

        Args:
            last_frame: Whether the fields of the last step are written.
            ended: Whether the run has not been interrupted; its fields are then gathered in one file.
        """
        try:
            if last_frame:
                self._field()
        finally:
            try:
                self._save()
            finally:
                self.series.close()
        if ended:
            with suppress(OSError):  # the frames are complete as they are
                gather_frames(self.folder.path)

    def _row(self, step: Step) -> None:
        o = step.observation
        values = named_row(step.t, o.d, o.U, o.dU, o.D, o.dp, o.dp_plus)
        values |= {"dt": step.dt, "newton": step.report.iterations, "mesh": step.mesh_id}
        values |= {**observed(o), "distortion": step.distortion}
        if o.conformation is not None:
            self.worst.s_jump = max(self.worst.s_jump, o.conformation.s_jump)
        correction = step.dU_correction
        error = self.worst.add(step.t, step.mesh_id, o.dU, correction)
        if correction is not None and error is not None:
            values |= dict(zip(error_columns(self.case.n), [*correction, *error], strict=True))
        self.worst.widest = max(self.worst.widest, span(self.case, list(o.d)))
        for gap, (upstream, downstream) in zip(map(float, o.d), pairwise(self.transient.meshed.outlines), strict=True):
            arc = max(upstream.size_at(0.0), downstream.size_at(float(np.pi)))
            self.worst.narrowest = max(self.worst.narrowest, (gap, arc), key=lambda each: each[1] / each[0])
        self.series.row(values)

    def _field(self) -> None:
        step, self._pending = self._pending, None
        if step is not None and self.fields is not None:
            self.fields.write(frame(step, self.origin, self.pipe(step.t)))

    def _save(self) -> None:
        if self._latest is not None:
            begin = time.monotonic()
            self._latest.save(self.folder)
            self._latest, self._saved = None, time.monotonic()
            self._cost = self._saved - begin

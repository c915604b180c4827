"""`pairsim run`: one case from its file to a folder of results."""

from __future__ import annotations

import platform
import signal
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from mpi4py import MPI

from pairsim import __version__
from pairsim.case import Case
from pairsim.errors import InputError, RunFailure, TooManySteps, WallTime
from pairsim.fields import frame
from pairsim.mesh import MeshSettings
from pairsim.output import HEALTH, POLYMER_HEALTH, RunFolder, SeriesWriter, named_row, series_columns
from pairsim.progress import Reporter
from pairsim.solver import petsc_version
from pairsim.stepsize import StepControl
from pairsim.transient import Problem, Step, Transient
from pairsim.xdmf import FieldsWriter

SMALLEST_STEP = 1e-8


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes:
        status: "finished", "failed" or "interrupted".
        reason: "end", "contact", "max_gap", or the typed reason of a failure.
        message: One line for people.
    """

    status: str
    reason: str
    message: str

    @property
    def exit_code(self) -> int:
        """0 finished, 3 typed failure, 130 interrupted."""
        return {"finished": 0, "failed": 3, "interrupted": 130}[self.status]


def problem_of(case: Case) -> Problem:
    """The transient problem of a validated case."""
    time_options = case.time
    largest = max(case.betas, default=0.0)
    return Problem(
        case.betas,
        case.Ca_es,
        case.gaps,
        case.tube_length,
        case.ends == "periodic",
        MeshSettings(**case.cell_sizes),
        StepControl(time_options.tol, SMALLEST_STEP, time_options.max_step, time_options.fixed_step),
        time_options.first_step,
        polymer=case.polymer,
        t_end=time_options.end,
        U_m=2 * (1 - 2 / 3 * largest**2),  # Faxen's law without wall corrections: only a first guess
    )


def milestones(case: Case) -> list[float]:
    """Times that steps land on: the wanted outputs and the end."""
    end, every = case.time.end, case.output.every
    times = {t for t in case.output.times if 0 < t < end}
    if every is not None:
        times |= {k * every for k in range(1, int(np.ceil(end / every - 1e-9)))}
    return [*sorted(times), end]


class _Signals:
    """Turns SIGINT and SIGTERM into a flag that all processes look at between steps."""

    def __init__(self) -> None:
        self.caught = 0
        self._old: dict[int, Any] = {}

    def _catch(self, number: int, _: FrameType | None) -> None:
        if self.caught:  # a second one does not wait for the step to end
            raise KeyboardInterrupt
        self.caught = number

    def __enter__(self) -> _Signals:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._old[number] = signal.signal(number, self._catch)
        return self

    def __exit__(self, *_: object) -> None:
        for number, old in self._old.items():
            signal.signal(number, old)


class _Recorder:
    """Writes what a run yields; does nothing on other processes than the first."""

    def __init__(self, case: Case, folder: RunFolder | None, transient: Transient) -> None:
        self.case, self.folder, self.pipe = case, folder, transient.pipe
        self.origin = transient.history.h[0].copy()
        self.columns = HEALTH + (POLYMER_HEALTH if case.polymer else ())
        if folder is not None:
            self.series = SeriesWriter(folder.file("series.csv"), [*series_columns(case.n), *self.columns])
            self.fields = FieldsWriter(folder.path) if case.output.fields else None

    def row(self, step: Step) -> None:
        o = step.observation
        if self.folder is None:
            return
        values = named_row(step.t, o.d, o.U, o.D, o.dp, o.dp - self.pipe(step.t).gradient * self.case.tube_length)
        health: tuple[float, ...] = (
            step.dt,
            step.report.iterations,
            step.mesh_id,
            o.m,
            o.volume_error,
            step.distortion,
        )
        if o.conformation is not None:
            c = o.conformation
            health += (c.c_max, c.z, c.r, c.c_min, c.s_jump)
        self.series.row(values | dict(zip(self.columns, map(float, health), strict=True)))

    def field(self, step: Step) -> None:
        if self.folder is not None and self.fields is not None:
            self.fields.write(frame(step, self.origin, self.pipe(step.t)))

    def close(self) -> None:
        if self.folder is not None:
            self.series.close()
            if self.fields is not None:
                self.fields.close()


def _versions() -> dict[str, str]:
    names = ("fenics-basix", "fenics-ffcx", "fenics-ufl", "gmsh", "mpi4py", "numpy", "scipy", "h5py")
    found = {"pairsim": __version__, "python": platform.python_version(), "petsc": petsc_version()}
    for name in names:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "unknown"
    return found


def _collectively(comm: MPI.Comm, error: Exception | None) -> None:
    """Raise on every process what the first one met."""
    error = comm.bcast(error)
    if error is not None:
        raise error


def run_case(
    case: Case, directory: Path, *, comm: MPI.Comm, overwrite: bool, reporter: Reporter, command: str
) -> Outcome:
    """Run one case into a folder.

    Args:
        case: The validated case.
        directory: Where the results go.
        comm: Communicator of the case; every process calls this.
        overwrite: Replace the results of an earlier run.
        reporter: Shows progress (quiet on all processes but the first).
        command: The command line, for the record.

    Returns:
        How it ended. Whatever was computed is in the folder, also after a failure.

    Raises:
        InputError: The folder exists and may not be replaced.
    """
    folder: RunFolder | None = None
    error: Exception | None = None
    if comm.rank == 0:
        try:
            folder = RunFolder.create(directory, overwrite)
            folder.write_yaml("case.yaml", case.resolved())
        except (InputError, OSError) as caught:
            error = caught
    _collectively(comm, error)
    begin = time.perf_counter()
    started = time.strftime("%Y-%m-%dT%H:%M:%S%z")
    transient: Transient | None = None
    recorder: _Recorder | None = None

    def record(outcome: Outcome | None) -> None:
        if folder is None:
            return
        wall = time.perf_counter() - begin
        content: dict[str, Any] = {
            "status": outcome.status if outcome else "running",
            "reason": outcome.reason if outcome else "",
            "message": outcome.message if outcome else "",
            "started": started,
            "command": command,
            "processes": comm.size,
            "machine": {"node": platform.node(), "system": platform.platform(), "processor": platform.machine()},
            "versions": _versions(),
            "wall_time": wall,
        }
        if transient is not None:
            counts = transient.counts
            phases: dict[str, float] = dict(transient.clock.seconds)
            phases["other"] = wall - sum(phases.values())
            content |= {
                "t": transient.history.t[0],
                "steps": counts.steps,
                "rejected_steps": counts.rejected,
                "newton_iterations": counts.newton,
                "factorisations": counts.factorisations,
                "remeshings": counts.remeshings,
                "unknowns": transient.tie.size,
                "wall_time_by_phase": phases,
            }
        folder.write_json("run.json", content)

    record(None)
    reporter.start(case.name or case.slug, f"to t = {case.time.end:g}", case.time.end)
    for note in case.notes:
        reporter.note(note)
    try:
        with _Signals() as signals:
            transient = Transient(comm, problem_of(case))
            recorder = _Recorder(case, folder, transient)
            outcome = _march(case, transient, recorder, reporter, signals, begin)
    except KeyboardInterrupt:
        outcome = Outcome("interrupted", "interrupted", "stopped at once; the rows written so far stand")
    except RunFailure as failure:
        outcome = Outcome("failed", failure.reason, str(failure))
    finally:
        if recorder is not None:
            recorder.close()
    record(outcome)
    if transient is not None:
        transient.close()
    reporter.finish(outcome.message)
    return outcome


def _shown(step: Step, count: int) -> str:
    """A step in a line of progress."""
    o = step.observation
    gap = f"d = {o.d[0]:.5f}  dU = {o.U[1] - o.U[0]:+.4e}  " if o.d.size == 1 else ""
    return f"t = {step.t:.4g}  {gap}dt = {step.dt:.2g}  Newton {step.report.iterations}  step {count}"


def _march(
    case: Case, transient: Transient, recorder: _Recorder, reporter: Reporter, signals: _Signals, begin: float
) -> Outcome:
    """Take all steps, write them, and find the end."""
    comm, limits = transient.comm, case.limits
    wanted = milestones(case)
    pending: Step | None = None
    outcome: Outcome | None = None
    steps: Iterator[Step] = transient.steps(iter(wanted))
    try:
        for step in steps:
            o = step.observation
            with transient.clock("output"):
                recorder.row(step)
                at_output = any(abs(step.t - t) <= 1e-9 * max(1.0, t) for t in wanted)
                if at_output or transient.counts.steps == 1:
                    recorder.field(step)
                    pending = None
                else:
                    pending = step
            reporter.update(step.t, _shown(step, transient.counts.steps), transient.counts.steps)
            stop = comm.allreduce((signals.caught, time.perf_counter() - begin), op=MPI.MAX)
            count = transient.counts.steps
            if o.d.size and o.d.min() < limits.min_gap:
                outcome = Outcome(
                    "finished", "contact", f"contact: the gap fell below {limits.min_gap:g} at t = {step.t:g}"
                )
            elif limits.max_gap is not None and o.d.size and o.d.max() > limits.max_gap:
                outcome = Outcome("finished", "max_gap", f"the gap passed {limits.max_gap:g} at t = {step.t:g}")
            elif stop[0]:
                name = signal.Signals(stop[0]).name
                outcome = Outcome(
                    "interrupted", "interrupted", f"{name} at t = {step.t:g}; the rows written so far stand"
                )
            elif limits.wall_time is not None and stop[1] > limits.wall_time:
                message = f"{stop[1]:.0f} s have passed"
                raise WallTime(message, t=step.t, step=count, advice="a larger limits.wall_time")
            elif transient.counts.steps >= limits.max_steps and step.t < case.time.end * (1 - 1e-12):
                message = f"{limits.max_steps} steps were taken"
                raise TooManySteps(message, t=step.t, step=count, advice="a larger limits.max_steps")
            if outcome is not None:
                break
    finally:
        if pending is not None and sys.exc_info()[0] is not KeyboardInterrupt:
            recorder.field(pending)
    return outcome or Outcome("finished", "end", f"finished at t = {transient.history.t[0]:g}")

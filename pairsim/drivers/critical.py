"""`pairsim critical`: critical distances from a case file to a folder of results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from pairsim.config.curve_case import CriticalCase
from pairsim.config.form_kinds import forms_of
from pairsim.drivers.curve import point_row, tell
from pairsim.drivers.outcome import Outcome, Record, concluded, new_folder, written
from pairsim.drivers.problems import steady_problem
from pairsim.drivers.progress import Reporter
from pairsim.fem.form_cache import ensure_compiled
from pairsim.results.columns import CRITICAL_COLUMNS, CURVE_HEALTH, POLYMER_HEALTH
from pairsim.results.output import RunFolder, write_table
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.runtime.fenicsx import MPI
from pairsim.runtime.locks import sole_writer
from pairsim.solvers.branch import Branch, Point
from pairsim.solvers.critical import Critical, End, Followed, follow_all, search, with_value
from pairsim.solvers.parameters import Parameters


class CriticalOutput:
    """Writes critical.csv as it grows; does nothing on other processes than the first."""

    def __init__(self, case: CriticalCase, comm: MPI.Comm, folder: RunFolder | None, reporter: Reporter) -> None:
        self.comm, self.folder, self.reporter = comm, folder, reporter
        health = CURVE_HEALTH + (POLYMER_HEALTH if case.polymer else ())
        self.columns = [*CRITICAL_COLUMNS, *(["mesh_error", "d_error"] if case.mesh_error else []), *health]
        self.rows: list[dict[str, Any]] = []
        self.points: list[Point] = []
        self.jumps: list[str] = []
        self.first_branch = self.solved = self.wanted = 0

    def scanned(self, point: Point) -> None:
        """A point was solved in search of zeros."""
        self.solved += 1
        self.reporter.update(self.wanted, f"search: d = {point.d:.5f}  dU = {point.dU:+.4e}", self.solved)

    def found(self, critical: Critical) -> None:
        """Take a critical distance in."""
        point, number = critical.point, critical.branch + self.first_branch
        self.solved += 1
        self.wanted += critical.kind == "wanted"
        self.points.append(point)
        row: dict[str, Any] = dict(point_row(point))
        place = point.parameters
        row |= {"Ca_e": max(place.Ca_es), "De": place.De, "d_cr": point.d, "U": row["U_T"]}
        row |= {"kind": critical.kind, "branch": number, "stable": "true" if row["slope"] < 0 else "false"}
        if "mesh_error" in row:
            row["d_error"] = row["mesh_error"] / abs(row["slope"])
        self.rows.append({name: row[name] for name in self.columns})
        text = f"Ca_e = {row['Ca_e']:.5g}  De = {place.De:.5g}  d_cr = {point.d:.5f}  {critical.kind}"
        self.reporter.update(self.wanted, text, self.solved)
        self.write()

    def write(self) -> None:
        """Write the table.

        Raises:
            WriteFailure: It cannot be written.
        """

        def write() -> None:
            assert self.folder is not None
            write_table(self.folder.file("critical.csv"), self.columns, self.rows)

        written(self.comm, write)


def run_critical(
    case: CriticalCase, directory: Path, *, comm: MPI.Comm, overwrite: bool, reporter: Reporter, command: str
) -> Outcome:
    """Find and follow critical distances into a folder.

    Args:
        case: The validated case.
        directory: Where the results go.
        comm: Communicator of the case; every process calls this.
        overwrite: Replace earlier results.
        reporter: Shows progress (quiet on all processes but the first).
        command: The command line, for the record.

    Returns:
        How it ended. Whatever was found is in the folder, also after a failure.

    Raises:
        InputError: The folder exists and may not be replaced, or another command is at work there.
    """
    with sole_writer(comm, directory, command):
        return _run(case, directory, comm, overwrite, reporter, command)


def _run(
    case: CriticalCase, directory: Path, comm: MPI.Comm, overwrite: bool, reporter: Reporter, command: str
) -> Outcome:
    """What `run_critical` does in a folder of its own."""
    folder = new_folder(comm, directory, overwrite, case.resolved())
    record = Record(folder, command, comm.size)
    record.write(None, {}, {})
    least, most = case.d
    name, values = next(iter(case.along.items())) if case.along else (None, ())
    lines = next(iter(case.lines.items())) if case.lines else None
    count = max(len(values), 1) * (len(lines[1]) if lines else 1)
    reporter.start(case.name or case.slug, f"zeros of dU between d = {least:g} and {most:g}", count)
    for note in case.notes:
        reporter.note(note)
    recorder = CriticalOutput(case, comm, folder, reporter)
    branch: Branch | None = None
    ends: list[dict[str, Any]] = []

    def ended(end: End, told: dict[str, Any]) -> None:
        ends.append({**told, **vars(replace(end, branch=end.branch + recorder.first_branch))})
        reporter.note(f"branch {ends[-1]['branch']}: {end.message}")

    def work() -> str:
        nonlocal branch
        recorder.write()
        ensure_compiled(comm, forms_of(case))
        here = Parameters((most,), case.Ca_es, case.De)
        if name is not None:
            here = with_value(cast(Followed, name), here, min(values))
        lost: list[str] = []
        for line in sorted(lines[1]) if lines else (None,):
            if lines is not None and line is not None:
                here = with_value(cast(Followed, lines[0]), here, line)
            try:
                if branch is None:
                    branch = Branch(comm, steady_problem(case, least), here, case.mesh_error)
                branch.at(here)
                told = _named(lines, line)
                _line(branch, name, sorted(values), least, most, recorder, lambda end, told=told: ended(end, told))  # type: ignore[misc]
            except (NoSteadyState, MeshFailure) as failure:
                if lines is None:
                    raise
                lost.append(f"{lines[0]} = {line:g}: {failure}")
                reporter.note(lost[-1])
            recorder.first_branch = max((row["branch"] for row in recorder.rows), default=0)
        if lost:
            raise NoSteadyState("; ".join(lost))
        return f"{len(recorder.rows)} critical distances on {recorder.first_branch} branches"

    outcome = concluded(work)
    outcome = tell(case, record, outcome, branch, recorder.points, {"ends": ends}, reporter, recorder.jumps)
    if branch is not None:
        branch.close()
    reporter.finish(outcome.message)
    return outcome


def _named(lines: tuple[str, tuple[float, ...]] | None, value: float | None) -> dict[str, Any]:
    return {lines[0]: value} if lines is not None else {}


def _line(
    branch: Branch,
    name: str | None,
    values: list[float],
    least: float,
    most: float,
    recorder: CriticalOutput,
    ended: Callable[[End], None],
) -> None:
    """The critical distances at the branch's other parameters."""
    if name is not None:
        told = recorder.scanned, recorder.found, recorder.jumps.append, ended
        follow_all(branch, cast(Followed, name), values, least, most, *told)
        return
    zeros = search(branch, least, most, recorder.scanned, recorder.jumps.append)
    for number, zero in enumerate(zeros, start=1):
        recorder.found(Critical(zero.point, number, "wanted"))

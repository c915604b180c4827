"""`pairsim curve`: a master curve from its file to a folder of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.config.case import SceneCase
from pairsim.config.curve_case import CurveCase
from pairsim.config.form_kinds import forms_of
from pairsim.drivers.outcome import Outcome, Record, concluded, new_folder, written
from pairsim.drivers.problems import solution_order, steady_problem
from pairsim.drivers.progress import Reporter
from pairsim.drivers.warnings import coarse_mesh, near_ends, unresolved_stress
from pairsim.fem.form_cache import ensure_compiled
from pairsim.results.columns import CURVE_HEALTH, POLYMER_HEALTH, curve_columns, gap_endings, named_row
from pairsim.results.fields import SteadyMoment, frame
from pairsim.results.output import RunFolder, write_table
from pairsim.results.xdmf import FieldFrame, FieldsWriter
from pairsim.runtime.errors import NoSteadyState, RunFailure
from pairsim.runtime.fenicsx import MPI
from pairsim.runtime.locks import sole_writer
from pairsim.solvers.branch import Branch, Point
from pairsim.solvers.curve import Equilibrium, Zero, equilibria, find_zeros, trace
from pairsim.solvers.parameters import Parameters, SteadyProblem
from pairsim.solvers.steady import Steady


def point_row(point: Point) -> dict[str, float]:
    """Everything that is told of a quasi-steady solution, under the names of its columns."""
    o = point.observation
    row = named_row(0.0, point.gaps, o.U, o.dU, o.D, o.dp, o.dp_plus)
    gaps = gap_endings(o.d.size + 1)
    values = {"slope": point.slopes, "drift": point.drifts, "mesh_error": point.mesh_errors}
    values |= {f"by_{name}": change for name, change in point.sensitivities.items()}
    for name, each in values.items():
        row |= {name + gap: value for gap, value in zip(gaps, each if each is not None else (), strict=False)}
    row |= {"newton": point.newton, "meshes": point.meshes, "m": o.m}
    row |= {"volume_error": o.volume_error, "distortion": point.distortion}
    if o.conformation is not None:
        c = o.conformation
        row |= dict(zip(POLYMER_HEALTH, (c.c_max, c.z, c.r, c.c_min, c.s_jump), strict=True))
    return {name: float(value) for name, value in row.items()}


def effort(branch: Branch | None) -> tuple[dict[str, Any], dict[str, float]]:
    """What a branch has cost: counts, and seconds by phase, for run.json."""
    if branch is None:
        return {}, {}
    counts = {
        "newton_iterations": sum(s.iterations for s in branch.scenes),
        "factorisations": sum(s.factorisations for s in branch.scenes),
        "meshes": sum(s.meshes for s in branch.scenes),
        "unknowns": branch.fine.constraints.size,
    }
    phases: dict[str, float] = {}
    for scene in branch.scenes:
        for name, seconds in scene.clock.seconds.items():
            phases[name] = phases.get(name, 0.0) + seconds
    return counts, phases


def tell(
    case: SceneCase,
    record: Record,
    outcome: Outcome,
    branch: Branch | None,
    points: list[Point],
    more: dict[str, Any],
    reporter: Reporter,
    told: Sequence[str] = (),
) -> Outcome:
    """Write the end of run.json: how it ended, what it cost, and warnings, those of mesh, stresses and tube added.

    Returns:
        The outcome, on the first process that of a failure where run.json cannot be written.
    """
    counts, phases = effort(branch)
    seen = [c.s_jump for p in points if (c := p.observation.conformation) is not None]
    stress = unresolved_stress(case, max(seen, default=0.0))
    told = [*told, *coarse_mesh(case), *stress, *near_ends(case, case.cluster)]
    for warning in told:
        reporter.note(warning)
    try:
        record.write(outcome, {**more, **counts, "warnings": told}, phases)
    except OSError as error:
        return Outcome("failed", "write_failed", f"run.json cannot be written: {error}")
    return outcome


class CurveOutput:
    """Writes the files of a curve as they grow; does nothing on other processes than the first."""

    def __init__(
        self, case: CurveCase, comm: MPI.Comm, folder: RunFolder | None, reporter: Reporter, sensitivities: bool
    ) -> None:
        self.case, self.comm, self.folder, self.reporter = case, comm, folder, reporter
        self.points: list[tuple[Point, bool]] = []
        parameters = [name for name, value in (("Ca_e", max(case.Ca_es)), ("De", case.De), ("beta", 1.0)) if value]
        health = CURVE_HEALTH + (POLYMER_HEALTH if case.polymer else ())
        self.columns = [
            *curve_columns(case.n, case.common, case.mesh_error, parameters if sensitivities else []),
            *health,
        ]
        self.frames: list[FieldFrame] = []

    def found(self, point: Point, wanted: bool, scene: Steady, expected: int) -> None:
        """Take a new point in."""
        self.points.append((point, wanted))
        count = len(self.points)
        o = point.observation
        gaps = f"d = {', '.join(f'{d:.5f}' for d in point.gaps)}  " if point.gaps else ""
        velocities = ", ".join(f"{dU:+.4e}" for dU in o.dU) if o.U.size > 1 else f"{o.U[0]:.6f}"
        name = "dU" if o.U.size > 1 else "U"
        self.reporter.update(
            min(count, expected), f"{gaps}{name} = {velocities}  Newton {point.newton}  point {count}", count
        )
        if self.case.common:
            self.points.sort(key=lambda entry: entry[0].d)
        rows = [point_row(p) | {"wanted": float(asked)} for p, asked in self.points]
        self._write("curve.csv", self.columns, rows)
        if self.folder is not None and any(abs(point.d - d) < 1e-9 * d for d in self.case.fields):
            (h, x), flow = scene.state(), scene.developed_flow
            undeformed = np.concatenate([np.zeros(body.size) for body in scene.bodies])
            for body, centre in zip(scene.bodies, scene.centres, strict=True):
                undeformed[body.start : body.start + body.size : 2] = centre
            moment = SteadyMoment(point.d, scene.scene, scene.meshes, x, h, scene.constraints.V @ scene.y)
            self.frames.append(frame(moment, undeformed, flow))

    def zeros(self, zeros: list[Equilibrium]) -> None:
        """Write equilibria.csv."""
        words = {True: "true", False: "false"}
        rows = []
        for z in zeros:
            row: dict[str, Any] = {"d": z.d, "stable": words[z.stable], "slope": z.slope, "peak": z.peak}
            if z.d_error is not None and z.certain is not None:
                row |= {"d_error": z.d_error, "certain": words[z.certain]}
            rows.append(row)
        columns = ["d", "stable", "slope", "peak", *(["d_error", "certain"] if self.case.mesh_error else [])]
        self._write("equilibria.csv", columns, rows)

    def _write(self, name: str, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
        def write() -> None:
            assert self.folder is not None
            write_table(self.folder.file(name), columns, rows)

        written(self.comm, write)

    def close(self, alone: bool) -> None:
        """Write the fields: in ascending distance, which is not the order in which they were solved.

        Args:
            alone: The other processes may be anywhere: nothing is told to them.

        Raises:
            WriteFailure: They cannot be written.
        """

        def write() -> None:
            assert self.folder is not None
            if self.frames:
                with closing(FieldsWriter(self.folder.path)) as fields:
                    for kept in sorted(self.frames, key=lambda kept: kept.t):
                        fields.write(kept)

        if not alone:
            written(self.comm, write)
        elif self.folder is not None:
            with suppress(OSError):
                write()


class WarmStart:
    """Hands the solutions of one curve to the next as its start."""

    def __init__(self) -> None:
        self._branch: Branch | None = None
        self._kind: tuple[Any, ...] = ()

    def start(
        self, comm: MPI.Comm, problem: SteadyProblem, first: Parameters, mesh_error: bool, sensitivities: bool
    ) -> Branch:
        """A branch at the first place of a curve, from the curve before or, where there is no way, from the beginning.

        Raises:
            NoSteadyState: There is no solution at the first place.
        """
        polymer = problem.polymer and replace(problem.polymer, De=1.0)
        rigid = [Ca_e == 0 for Ca_e in first.Ca_es]
        old, self._kind = self._kind, (replace(problem, polymer=polymer), rigid, mesh_error, sensitivities)
        if self._branch is not None and self._kind == old:  # the same but for De, Ca_e and distances
            try:
                self._branch.move(first)
                return self._branch
            except NoSteadyState:
                pass
        self.close()
        self._branch = Branch(comm, problem, first, mesh_error, sensitivities)
        return self._branch

    def close(self) -> None:
        """Give the solvers' memory back; the next curve starts from the beginning."""
        if self._branch is not None:
            self._branch.close()
        self._branch = None


def run_curve(
    case: CurveCase,
    directory: Path,
    *,
    comm: MPI.Comm,
    overwrite: bool,
    reporter: Reporter,
    command: str,
    sensitivities: bool = False,
    warm_start: WarmStart | None = None,
) -> Outcome:
    """Solve a master curve into a folder.

    Args:
        case: The validated case.
        directory: Where the results go.
        comm: Communicator of the case; every process calls this.
        overwrite: Replace earlier results.
        reporter: Shows progress (quiet on all processes but the first).
        command: The command line, for the record.
        sensitivities: Add the derivatives of dU by Ca_e, De and beta.
        warm_start: Start from the curve before, and leave this one's solutions to the next; the caller closes it.

    Returns:
        How it ended. Whatever was solved is in the folder, also after a failure.

    Raises:
        InputError: The folder exists and may not be replaced, or another command is at work there.
    """
    with sole_writer(comm, directory, command):
        return _run(case, directory, comm, overwrite, reporter, command, sensitivities, warm_start)


def _run(
    case: CurveCase,
    directory: Path,
    comm: MPI.Comm,
    overwrite: bool,
    reporter: Reporter,
    command: str,
    sensitivities: bool,
    warm_start: WarmStart | None,
) -> Outcome:
    """What `run_curve` does in a folder of its own."""
    folder = new_folder(comm, directory, overwrite, case.resolved())
    record = Record(folder, command, comm.size)
    record.write(None, {}, {})
    places = solution_order(case)
    expected = max(len(places), 1)
    reporter.start(case.name or case.slug, f"{expected} point{'s' * (expected > 1)} and those that are added", expected)
    for note in case.notes:
        reporter.note(note)
    recorder = CurveOutput(case, comm, folder, reporter, sensitivities)
    own = WarmStart()
    branch: Branch | None = None
    jumps: list[str] = []

    def work() -> str:
        nonlocal branch
        ensure_compiled(comm, forms_of(case))
        start = Parameters(places[0], case.Ca_es, case.De)
        narrowest = min((d for place in places for d in place), default=np.inf)
        problem = steady_problem(case, narrowest)
        branch = (warm_start or own).start(comm, problem, start, case.mesh_error, sensitivities)
        fine = branch.fine
        points = trace(
            branch,
            places,
            case.tol,
            case.max_points,
            lambda point, wanted: recorder.found(point, wanted, fine, expected),
        )
        message = f"{len(points)} points"
        if case.n == 2:
            found: list[Zero] = []
            try:
                for zero in find_zeros(branch, points, jumps.append):
                    found.append(zero)
            except RunFailure:  # those before the one that was lost stand
                recorder.zeros(equilibria(found, points))
                raise
            zeros = equilibria(found, points)
            recorder.zeros(zeros)
            kinds = [
                f"{'stable' if z.stable else 'unstable'} at d = {z.d:.5g}{' (uncertain)' if z.certain is False else ''}"
                for z in zeros
            ]
            message += f"; dU = 0: {', '.join(kinds) or 'nowhere'}"
        return message

    def close(alone: bool = False) -> str:
        recorder.close(alone)
        return outcome.message

    outcome = concluded(work)
    if outcome.status == "interrupted":
        close(alone=True)
    else:
        closed = concluded(close)
        outcome = closed if outcome.status == "finished" else outcome
    points = [p for p, _ in recorder.points]
    outcome = tell(case, record, outcome, branch, points, {"points": len(points)}, reporter, jumps)
    own.close()
    if warm_start is not None and outcome.status != "finished":
        warm_start.close()
    reporter.finish(outcome.message)
    return outcome

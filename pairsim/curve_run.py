"""`pairsim curve`: a master curve from its file to a folder of results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from pairsim.curve import Branch, Equilibrium, Point, equilibria, order, steady_problem, trace
from pairsim.curve_case import CurveCase
from pairsim.errors import RunFailure
from pairsim.fields import SteadyMoment, frame
from pairsim.output import CURVE_HEALTH, POLYMER_HEALTH, RunFolder, curve_columns, named_row, write_table
from pairsim.progress import Reporter
from pairsim.record import Outcome, Record, new_folder
from pairsim.steady import Parameters, Steady
from pairsim.xdmf import FieldsWriter


class _Recorder:
    """Writes the files of a curve as they grow; does nothing on other processes than the first."""

    def __init__(self, case: CurveCase, folder: RunFolder | None, reporter: Reporter) -> None:
        self.case, self.folder, self.reporter = case, folder, reporter
        self.points: list[tuple[Point, bool]] = []
        health = CURVE_HEALTH + (POLYMER_HEALTH if case.polymer else ())
        self.columns = [*curve_columns(case.n, case.common), *health]
        if not case.mesh_error:
            self.columns = [name for name in self.columns if not name.startswith("mesh_error")]
        self.fields = FieldsWriter(folder.path) if folder is not None and case.fields else None

    def row(self, point: Point, wanted: bool) -> dict[str, float]:
        """A point under the names of the columns."""
        o = point.observation
        row = named_row(0.0, o.d, o.U, o.D, o.dp, point.dp_plus)
        gaps = [""] if self.case.n == 2 else [f"_{i}" for i in range(1, self.case.n)]
        for name, values in (("slope", point.slopes), ("drift", point.drifts), ("mesh_error", point.mesh_errors)):
            row |= {name + gap: value for gap, value in zip(gaps, values if values is not None else (), strict=False)}
        row |= {"newton": point.newton, "wanted": wanted, "meshes": point.meshes, "m": o.m}
        row |= {"volume_error": o.volume_error, "distortion": point.distortion}
        if o.conformation is not None:
            c = o.conformation
            row |= dict(zip(POLYMER_HEALTH, (c.c_max, c.z, c.r, c.c_min, c.s_jump), strict=True))
        return {name: float(row[name]) for name in self.columns}

    def found(self, point: Point, wanted: bool, scene: Steady, allowed: int) -> None:
        """Take a new point in."""
        self.points.append((point, wanted))
        d = point.gaps[0] if len(set(point.gaps)) == 1 else None
        self.reporter.update(
            len(self.points) / allowed, d, point.dU if d is not None else None, 0.0, point.newton, len(self.points)
        )
        if self.folder is None:
            return
        if self.case.common:
            self.points.sort(key=lambda entry: entry[0].d)
        write_table(self.folder.file("curve.csv"), self.columns, [self.row(*entry) for entry in self.points])
        if self.fields is not None and any(abs(point.d - d) < 1e-9 * d for d in self.case.fields):
            (h, x), flow = scene.state(), scene.flow
            undeformed = np.concatenate([np.zeros(body.size) for body in scene.bodies])
            for body, centre in zip(scene.bodies, scene.centres, strict=True):
                undeformed[body.start : body.start + body.size : 2] = centre
            moment = SteadyMoment(point.d, scene.scene, scene.meshes, x, h, scene.tie.V @ scene.y)
            self.fields.write(frame(moment, undeformed, flow))

    def zeros(self, zeros: list[Equilibrium]) -> None:
        """Write equilibria.csv."""
        if self.folder is not None:
            rows = [
                {"d": z.d, "stable": "true" if z.stable else "false", "slope": z.slope, "peak": z.peak} for z in zeros
            ]
            write_table(self.folder.file("equilibria.csv"), ["d", "stable", "slope", "peak"], rows)

    def close(self) -> None:
        if self.fields is not None:
            self.fields.close()


def run_curve(
    case: CurveCase, directory: Path, *, comm: MPI.Comm, overwrite: bool, reporter: Reporter, command: str
) -> Outcome:
    """Solve a master curve into a folder.

    Args:
        case: The validated case.
        directory: Where the results go.
        comm: Communicator of the case; every process calls this.
        overwrite: Replace earlier results.
        reporter: Shows progress (quiet on all processes but the first).
        command: The command line, for the record.

    Returns:
        How it ended. Whatever was solved is in the folder, also after a failure.

    Raises:
        InputError: The folder exists and may not be replaced.
    """
    folder = new_folder(comm, directory, overwrite, case.resolved())
    record = Record(folder, command, comm.size)
    record.write(None, {}, {})
    places = order(case)
    reporter.start(case.slug, 1.0)
    for note in case.notes:
        reporter.note(note)
    recorder = _Recorder(case, folder, reporter)
    branch: Branch | None = None
    try:
        branch = Branch(comm, steady_problem(case), Parameters(places[0], case.Ca_es, case.De), case.mesh_error)
        fine = branch.fine
        count = len(places)
        points = trace(branch, case, lambda point, wanted: recorder.found(point, wanted, fine, max(count, 1)))
        message = f"{len(points)} points"
        if case.n == 2:
            zeros = equilibria(branch, points, lambda point: None)
            recorder.zeros(zeros)
            kinds = [f"{'stable' if z.stable else 'unstable'} at d = {z.d:.5g}" for z in zeros]
            message += f"; dU = 0: {', '.join(kinds) or 'nowhere'}"
        outcome = Outcome("finished", "end", message)
    except RunFailure as failure:
        outcome = Outcome("failed", failure.reason, str(failure))
    except KeyboardInterrupt:
        outcome = Outcome("interrupted", "interrupted", "stopped; the points solved so far stand")
    finally:
        recorder.close()
    more: dict[str, Any] = {"points": len(recorder.points)}
    phases: dict[str, float] = {}
    if branch is not None:
        scenes = branch.scenes
        more |= {
            "newton_iterations": sum(s.iterations for s in scenes),
            "factorisations": sum(s.factorisations for s in scenes),
            "meshes": sum(s.meshes for s in scenes),
            "unknowns": branch.fine.tie.size,
        }
        for scene in scenes:
            for name, seconds in scene.clock.seconds.items():
                phases[name] = phases.get(name, 0.0) + seconds
    record.write(outcome, more, phases)
    if branch is not None:
        branch.close()
    reporter.finish(outcome.message)
    return outcome

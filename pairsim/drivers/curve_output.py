"""Write and show the points of a curve as they are solved, its zeros, and the fields at chosen distances."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from pairsim.config.curve_case import CurveCase
from pairsim.drivers.quasi_steady import health_columns, point_row
from pairsim.drivers.session import Session
from pairsim.results.columns import EQUILIBRIA_COLUMNS, curve_columns
from pairsim.results.fields import SteadyMoment, frame
from pairsim.results.fields_writer import FieldsWriter, gather_frames
from pairsim.results.output import table_line
from pairsim.results.xdmf import FieldFrame
from pairsim.solvers.curves.branch import Point
from pairsim.solvers.curves.curve import Equilibrium
from pairsim.solvers.steady.scene import Steady


def _shown(point: Point, count: int) -> str:
    """A line of progress for a point."""
    o = point.observation
    gaps = f"d = {', '.join(f'{d:.5f}' for d in point.gaps)}  " if point.gaps else ""
    if len(o.F):
        name, values = "F", ", ".join(f"{F:.6g}" for F in o.F)
    elif o.U.size > 1:
        name, values = "dU", ", ".join(f"{dU:+.4e}" for dU in o.dU)
    else:
        name, values = "U", f"{o.U[0]:.6f}"
    return f"{gaps}{name} = {values}  Newton {point.newton}  point {count}"


class CurveOutput:
    """Writes curve.csv, equilibria.csv and fields, and shows progress.

    Args:
        case: The case.
        session: The open session of the command.
        expected: Number of requested points.
        sensitivities: Whether points have derivatives with respect to the parameters.

    Attributes:
        points: The points; in ascending d if all gaps have the same distance.
        warnings: Warnings about the results.
    """

    def __init__(self, case: CurveCase, session: Session, expected: int, sensitivities: bool) -> None:
        self.case, self.session, self.expected = case, session, expected
        self._rows: list[tuple[Point, str]] = []  # the points and their rows of curve.csv
        self.warnings: list[str] = []
        parameters = [name for name, value in (("Ca_e", max(case.Ca_es)), ("De", case.De), ("beta", 1.0)) if value]
        parameters = parameters if sensitivities else []
        columns = curve_columns(case.n, case.common, case.mesh_error, parameters, case.velocity is not None)
        self._columns = [*columns, *health_columns(case)]
        self._frames: list[FieldFrame] = []

    @property
    def points(self) -> list[Point]:
        """See the attributes of the class."""
        return [point for point, _ in self._rows]

    def take(self, point: Point, wanted: bool, scene: Steady) -> None:
        """Write a point, and keep its fields in memory if the case asks for fields at its distance.

        Args:
            point: The point.
            wanted: Whether it was requested, and not added by the refinement of the curve.
            scene: The solver, whose current solution is that of the point.

        Raises:
            WriteFailure: The table cannot be written.
        """
        line = table_line(self._columns, point_row(point) | {"wanted": float(wanted)})
        self._rows.append((point, line))
        count = len(self._rows)
        self.session.reporter.update(min(count, self.expected), _shown(point, count), count)
        if self.case.common:
            self._rows.sort(key=lambda row: row[0].d)
        self.session.write_table("curve.csv", self._columns, [row for _, row in self._rows])
        if any(abs(point.d - d) < 1e-9 * d for d in self.case.fields):
            (h, x), flow = scene.state(), scene.developed_flow
            moment = SteadyMoment(point.d, scene.scene, scene.meshes, x, h, scene.constraints.V @ scene.y)
            self._frames.append(frame(moment, scene.h_star(scene.parameters), flow))

    def take_zeros(self, zeros: Sequence[Equilibrium]) -> None:
        """Write equilibria.csv.

        Raises:
            WriteFailure: It cannot be written.
        """
        words = {True: "true", False: "false"}
        rows = []
        for z in zeros:
            row: dict[str, Any] = {"d": z.d, "stable": words[z.stable], "slope": z.slope, "peak": z.peak}
            rows.append(row | {"d_error": z.d_error, "certain": words[z.certain]})
        self.session.write_table("equilibria.csv", EQUILIBRIA_COLUMNS, rows)

    def finish(self) -> None:
        """Write the kept fields in ascending distance.

        Raises:
            WriteFailure: They cannot be written.
        """

        def write() -> None:
            if self._frames:
                fields = FieldsWriter(self.session.folder.path)
                for kept in sorted(self._frames, key=lambda kept: kept.t):
                    fields.write(kept)
                with suppress(OSError):  # the frames are complete as they are
                    gather_frames(self.session.folder.path)

        self.session.write(write)

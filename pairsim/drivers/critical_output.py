"""Write and show critical distances as they are found."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

from pairsim.config.curve_case import CriticalCase
from pairsim.drivers.quasi_steady import error_at, health_columns, point_row
from pairsim.drivers.session import Session
from pairsim.drivers.warnings import ErrorAt
from pairsim.results.columns import CRITICAL_COLUMNS
from pairsim.solvers.curves.branch import Point
from pairsim.solvers.curves.critical import Critical, End, Finding, Followed, Missed, value_of
from pairsim.solvers.curves.curve import Jump


class CriticalOutput:
    """Writes critical.csv and shows progress.

    Args:
        case: The case.
        session: The open session of the command.

    Attributes:
        rows: Rows of critical.csv so far.
        points: The quasi-steady solutions at the critical distances.
        kept_points: Those whose error `accuracy` is kept for: critical distances at requested values.
        errors: Their estimated errors, relative to the distance or, where two zeros meet, to the parameter.
        ends: Entries of run.json about the ends of the branches.
        warnings: Warnings about the results.
    """

    def __init__(self, case: CriticalCase, session: Session) -> None:
        self.session = session
        self._followed = None if case.along is None else cast(Followed, next(iter(case.along)))
        self._columns = [*CRITICAL_COLUMNS, *(["mesh_error"] if case.mesh_error else []), *health_columns(case)]
        self.rows: list[dict[str, Any]] = []
        self.points: list[Point] = []
        self.kept_points: list[Point] = []
        self.errors: list[ErrorAt] = []
        self.ends: list[dict[str, Any]] = []
        self.warnings: list[str] = []
        self._solved = self._wanted = 0
        self.begin_line({})

    @property
    def branches(self) -> int:
        """Number of branches with a critical distance."""
        return max((row["branch"] for row in self.rows), default=0)

    def begin_line(self, line: dict[str, float]) -> None:
        """Begin a line; its branches are numbered after those of the lines before.

        Args:
            line: The parameter of the line and its value, empty without `lines`.
        """
        self._line, self._branches_before = line, self.branches

    def take(self, found: Finding) -> None:
        """Show a finding; if it is a critical distance, write it.

        Raises:
            WriteFailure: The table cannot be written.
        """
        match found:
            case Point():
                self._solved += 1
                text = f"search: d = {found.d:.5f}  dU = {found.dU:+.4e}"
                self.session.reporter.update(self._wanted, text, self._solved)
            case Critical():
                self._take_critical(found)
            case End():
                numbered = replace(found, branch=found.branch + self._branches_before)
                self.ends.append({**self._line, **vars(numbered)})
                self.session.reporter.note(f"branch {numbered.branch}: {numbered.message}")
            case Jump() | Missed():
                self.warnings.append(found.message)

    def _take_critical(self, critical: Critical) -> None:
        point, number = critical.point, critical.branch + self._branches_before
        self._solved += 1
        self._wanted += critical.kind == "wanted"
        self.points.append(point)
        self.kept_points += [point] if critical.kind == "wanted" else []
        row: dict[str, Any] = dict(point_row(point))
        place = point.parameters
        row |= {"Ca_e": max(place.Ca_es), "De": place.De, "d_cr": point.d, "U": row["U_T"]}
        row["slope"] = point.slope_at_rest
        row |= {"kind": critical.kind, "branch": number, "stable": "true" if row["slope"] < 0 else "false"}
        row |= {"d_error": "", "parameter_error": ""}
        if critical.by_parameter is None:
            row["d_error"] = row["dU_error"] / abs(row["slope"])
            size = abs(row["slope"]) * point.d
        else:  # where two zeros meet, the slope vanishes
            row["parameter_error"] = row["dU_error"] / abs(critical.by_parameter)
            assert self._followed is not None
            size = abs(critical.by_parameter) * value_of(self._followed, place)
        self.errors.append(error_at(point, 0, size))
        self.rows.append({name: row[name] for name in self._columns})
        text = f"Ca_e = {row['Ca_e']:.5g}  De = {place.De:.5g}  d_cr = {point.d:.5f}  {critical.kind}"
        self.session.reporter.update(self._wanted, text, self._solved)
        self.write()

    def write(self) -> None:
        """Write critical.csv.

        Raises:
            WriteFailure: It cannot be written.
        """
        self.session.write_table("critical.csv", self._columns, self.rows)

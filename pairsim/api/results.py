"""Results of a computation: tables, fields, status and warnings, from a folder."""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from pairsim.api.cases import load
from pairsim.api.curve import Curve
from pairsim.cases.case import SceneCase
from pairsim.computing import Question
from pairsim.computing.answer import cost_line
from pairsim.computing.question import Tables, rows_in
from pairsim.physics.scales import Scales
from pairsim.results.columns import EQUILIBRIA_COLUMNS
from pairsim.results.folder import valid_record
from pairsim.results.travel import Travel, travel
from pairsim.results.units import scales_of
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import BranchEnd, InputError, failure_of

if TYPE_CHECKING:
    import pandas as pd
    import pyvista as pv

    from pairsim.results.xdmf import FieldFrame


class Result:
    """The result of a computation; returned by `run`, `curve`, `critical` and `open`.

    Files are read when first accessed, and only once. To see the progress of a running computation, `open` its folder
    again.

    Args:
        folder: The folder of results.
        command: The command that wrote it.
        ending: Status, reason and message, if they are not to be taken from run.json: a sweep also records crashes and
            timeouts. None: those of run.json.
        temporary: Whether the folder goes with the result.

    Attributes:
        folder: The folder; None for one that is temporary.
        command: The command that computed it.
    """

    def __init__(
        self, folder: Path, command: Question[Any], ending: Mapping[str, Any] | None = None, temporary: bool = False
    ) -> None:
        self.folder = None if temporary else folder
        self.command, self._ending, self._place = command, ending, folder
        if temporary:
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

    @cached_property
    def record(self) -> dict[str, Any]:
        """The content of run.json: outcome, cost, versions and machine; empty if the file is missing.

        Raises:
            InputError: The file is invalid.
        """
        return valid_record(self._place) if (self._place / "run.json").is_file() else {}

    @cached_property
    def table(self) -> pd.DataFrame:
        """The main table, with the columns of its CSV file (see the reference).

        Counts are integers; `table.attrs["units"]` has the unit of each column.
        """
        return self._frame(self.command.tables[0])

    def _frame(self, name: str) -> pd.DataFrame:
        """A table of the command with pandas, whose import takes .4 s; empty if it is not there."""
        from pairsim.results.tables import frame_of

        return frame_of(self._columns[name])

    @cached_property
    def columns(self) -> Mapping[str, Array]:
        """The columns of the main table as arrays by name."""
        return self._columns[self.command.tables[0]]

    @cached_property
    def _columns(self) -> Tables:
        return self.command.read_tables(self._place)

    @property
    def scales(self) -> Scales:
        """The units of length, velocity and viscosity in SI units; also `scales.time` and `scales.stress`.

        Raises:
            InputError: The case has no `physical` block.
        """
        return scales_of(self.record, self.command.name if self.folder is None else str(self.folder))

    @property
    def physical(self) -> pd.DataFrame:
        """The main table in um, s, um/s and Pa.

        Raises:
            InputError: The case has no `physical` block.
        """
        from pairsim.results.tables import in_units

        return in_units(self.table, self.scales)

    @property
    def tidy(self) -> pd.DataFrame:
        """The main table with a row for each gap: t (of a run), gap (from upstream), d, dU and its error."""
        from pairsim.results.tables import tidy

        return tidy(self.table)

    @property
    def kind(self) -> str:
        """Name of the command."""
        return self.command.name

    @cached_property
    def case(self) -> SceneCase:
        """The case, with every default filled in.

        Raises:
            InputError: case.yaml is missing, or not valid in this version.
        """
        return load(self._place / "case.yaml", kind=self.kind)

    def _ended(self, key: str) -> str:
        return str((self.record if self._ending is None else self._ending).get(key, ""))

    @property
    def status(self) -> str:
        """One of "finished", "failed", "interrupted" or "running" (or killed)."""
        return self._ended("status") or "running"

    @property
    def reason(self) -> str:
        """Why it ended: "end", "contact", "max_gap", "interrupted", or the `reason` of a `RunFailure`."""
        return self._ended("reason")

    @property
    def message(self) -> str:
        """One line of text on how it ended."""
        return self._ended("message")

    @property
    def warnings(self) -> list[str]:
        """Warnings about the results."""
        return list(self.record.get("warnings", ()))

    def check(self) -> Self:
        """Raise an exception unless the computation has finished.

        Returns:
            The result itself.

        Raises:
            RunFailure: It failed; the subclass is that of its `reason`.
            KeyboardInterrupt: It was interrupted.
        """
        if self.status == "interrupted":
            raise KeyboardInterrupt(self.message)
        if self.status != "finished":
            raise failure_of(self.reason, self.message or f"the computation is {self.status}")
        return self

    @property
    def answer(self) -> str:
        """The answer in words, a line or more: what the particles do, how fast, the cost and the warnings."""
        warnings = [f"Warning: {warning}" for warning in self.warnings]
        ended = [] if self.status == "finished" else [f"{self.status.capitalize()}: {self.message}"]
        cost = [cost_line(self.record)] if self.record else []
        if self.reason == BranchEnd.reason:
            ended = [f"There is no steady state: {self.message}."]
        found = self._answer() if self._place.is_dir() else []  # it may have been removed
        return "\n".join([*ended, *found, *warnings, *cost])

    def _answer(self) -> list[str]:
        if self.reason == BranchEnd.reason and not rows_in(self.columns):
            return []
        return self.command.answer(self._columns, self.record)

    def plot(self, folder: Path | str, **options: Any) -> list[Path]:
        """Draw the result, as `pairsim plot` does.

        Args:
            folder: Where to, made if needed.
            options: `formats`, `width`, `field` and `animate` of `pairsim.plot`.

        Returns:
            Paths of the pictures.

        Raises:
            InputError: There is nothing to draw yet, or an option is wrong.
        """
        from pairsim.api.pictures import plot

        return plot(self._place, out=folder, **options)

    @cached_property
    def places(self) -> Array:
        """Times [D_c/U_av] (of a curve: distances [D_c]) at which there are fields, shape (n,)."""
        from pairsim.results.xdmf import read_times

        return read_times(self._place)

    def fields(self, at: float) -> pv.UnstructuredGrid:
        """Velocity, pressure, displacement and stresses on the deformed mesh, as a pyvista grid.

        Args:
            at: One of `places`: a time, of a curve a distance.

        Returns:
            Names and components are as in fields.xdmf: vectors are (z, r, 0). Cell data: `region`, 0 in the liquid and
            i in particle i from upstream. Field data: `t`, the time or distance.

        Raises:
            InputError: There are no fields there.
        """
        from pairsim.results.xdmf import read_frame

        hits = np.flatnonzero(np.isclose(self.places, at, rtol=1e-9, atol=1e-12))
        if not hits.size:
            listed = ", ".join(f"{place:g}" for place in self.places)
            key = "fields: [...]" if self.command.frames == "d" else "output.fields: true"
            allowed = f"must be one of {listed}" if listed else f"was not written; the case needs `{key}` for fields"
            raise InputError("fields", self.command.frames, at, allowed)
        return _grid_of(read_frame(self._place, int(hits[0])))

    def _headline(self) -> str:
        reason = f" ({self.reason})" if self.reason not in ("", "end") else ""
        where = f", {self.folder}" if self.folder is not None else ""
        return f"pairsim {self.kind}: {self.status}{reason}, {len(self.table)} rows{where}"

    def __repr__(self) -> str:
        return f"<{self._headline()}>"


def _grid_of(frame: FieldFrame) -> pv.UnstructuredGrid:
    import pyvista as pv

    fields = frame.stored
    grid = pv.UnstructuredGrid({pv.CellType.QUADRATIC_TRIANGLE: frame.cells}, fields.pop("position"))
    grid.point_data.update(fields)
    grid.cell_data["region"] = frame.region
    grid.field_data["t"] = [frame.t]
    return grid


class RunResult(Result):
    """The result of a run in time. `table` is series.csv, with a row for each accepted step."""

    @property
    def times(self) -> Array:
        """Times at which there are fields [D_c/U_av], shape (n,)."""
        return self.places


class CurveResult(Result):
    """A master curve. `table` is curve.csv, with a row for each point."""

    @cached_property
    def equilibria(self) -> pd.DataFrame:
        """The zeros of dU (equilibria.csv): d, stable, slope, peak, d_error and certain."""
        found = self._frame("equilibria")
        return found if len(found.columns) else found.reindex(columns=list(EQUILIBRIA_COLUMNS))

    @property
    def zeros(self) -> pd.DataFrame:
        """Another name of `equilibria`."""
        return self.equilibria

    @cached_property
    def curve(self) -> Curve:
        """dU as a function of the distance: `dU, half_width = result.curve(d)`."""
        return Curve(self.columns)

    def dU(self, d: Any, gap: int = 1) -> Any:
        """dU at any distance of the curve [U_av]; see `curve`, which returns the half-width of its interval, too."""
        return self.curve(d, gap)[0]

    def travel(self, start: float | str, stop: float | str) -> Travel:
        """Time and length of tube in which the pair moves from one distance to another, as `pairsim travel`.

        Args:
            start: First distance: a number [D_c], or a text with a unit such as "5um".
            stop: Last distance.

        Returns:
            Time, length and their half-widths; as text what the command prints.

        Raises:
            InputError: A distance is outside the curve, or the pair does not move from the one to the other.
        """
        source = "curve" if self.folder is None else str(self.folder)
        return travel(self.columns, start, stop, source, self.record)

    @property
    def distances(self) -> Array:
        """Distances at which there are fields [D_c], shape (n,); see `fields` of the case."""
        return self.places

    def _headline(self) -> str:
        zeros = ", ".join(
            f"{'stable' if row.stable else 'unstable'} zero at d = {row.d:.5g}" for row in self.zeros.itertuples()
        )
        return super()._headline() + (f"; {zeros}" if zeros else "")


class CriticalResult(Result):
    """Critical distances. `table` is critical.csv, with a row for each zero of dU."""

    @property
    def ends(self) -> list[dict[str, Any]]:
        """For each end of a branch: where it is, and why the branch ends there."""
        return list(self.record.get("ends", ()))


TYPES: dict[str, type[Result]] = {"run": RunResult, "curve": CurveResult, "critical": CriticalResult}
"""Results that have more to ask for than a table, by the command."""


def result_of(
    command: Question[Any], folder: Path, ending: Mapping[str, Any] | None = None, temporary: bool = False
) -> Any:
    """The result of a command in a folder; arguments as for `Result`."""
    return TYPES.get(command.name, Result)(folder, command, ending, temporary)

"""Results of a computation: tables, fields, status and warnings, from a folder or in memory."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from pairsim.api.cases import load
from pairsim.commands import Command
from pairsim.commands.command import numbers_in
from pairsim.config.case import SceneCase
from pairsim.results.answer import cost_line
from pairsim.results.columns import EQUILIBRIA_COLUMNS
from pairsim.results.curve_table import curve_of
from pairsim.results.folders import valid_record
from pairsim.results.xdmf import FieldFrame, read_frame, read_times
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError, failure_of

if TYPE_CHECKING:
    import pandas as pd
    import pyvista as pv

SHOWN = 8  # rows of a table shown in a notebook


class Result:
    """The result of a computation; returned by `run`, `curve`, `critical` and `open`.

    Files are read when first accessed, and only once. To see the progress of a running computation, `open` its folder
    again.

    Args:
        folder: The folder of results.
        command: The command that wrote it.
        ending: Status, reason and message, if they are not to be taken from run.json: a sweep also records crashes and
            timeouts. None: those of run.json.

    Attributes:
        folder: The folder; None for a result that is only in memory.
        command: The command that computed it.
    """

    def __init__(self, folder: Path, command: Command[Any], ending: Mapping[str, Any] | None = None) -> None:
        self.folder: Path | None = folder
        self.command, self._ending = command, ending

    @property
    def _path(self) -> Path:
        assert self.folder is not None, "a result in memory has been read completely"
        return self.folder

    @cached_property
    def record(self) -> dict[str, Any]:
        """The content of run.json: outcome, cost, versions and machine; empty if the file is missing.

        Raises:
            InputError: The file is invalid.
        """
        return valid_record(self._path) if (self._path / "run.json").is_file() else {}

    @cached_property
    def table(self) -> pd.DataFrame:
        """The main table, with the columns of its CSV file (see the reference); counts are integers."""
        return self._tables[self.command.tables[0]]

    @cached_property
    def _tables(self) -> dict[str, pd.DataFrame]:
        """The tables of the command by name; one that is not there is empty."""
        return dict(self.command.read_tables(self._path))

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
        return load(self._path / "case.yaml", kind=self.kind)

    def _ended(self, key: str) -> str:
        return str((self.record if self._ending is None else self._ending).get(key, ""))

    @property
    def status(self) -> str:
        """One of "finished", "failed", "interrupted", "timeout" (in a sweep) or "running" (or killed)."""
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
        found = self._answer() if self.folder is None or self.folder.is_dir() else []  # it may have been removed
        return "\n".join([*ended, *found, *warnings, *cost])

    def _answer(self) -> list[str]:
        return self.command.answer(self._tables, self.record) if len(self.table) else [self.command.nothing]

    def _columns(self) -> dict[str, Array]:
        """The columns of the table whose values are numbers."""
        return numbers_in(self.table)

    def plot(self, folder: Path | str, **options: Any) -> list[Path]:
        """Draw the result, as `pairsim plot` does.

        Args:
            folder: Where to, made if needed.
            options: `formats`, `width`, `field` and `animate` of `pairsim.plot`.

        Returns:
            Paths of the pictures.

        Raises:
            InputError: The result is in memory only, there is nothing to draw yet, or an option is wrong.
        """
        from pairsim.api.pictures import plot

        if self.folder is None:
            raise InputError("plot", "folder", None, "the result is in memory only; compute it with folder=...")
        return plot(self.folder, out=folder, **options)

    @cached_property
    def _frame_times(self) -> Array:
        """Times (of a curve: distances) of the frames in fields.xdmf, shape (frames,); empty without the file."""
        return read_times(self._path)

    @cached_property
    def _frames(self) -> list[FieldFrame]:
        return [read_frame(self._path, i) for i in range(len(self._frame_times))]

    def _fields(self, name: str, value: float) -> pv.UnstructuredGrid:
        """The fields at a time or distance.

        Raises:
            InputError: There are none.
        """
        from pairsim.api.grids import grid_of

        places = self._frame_times
        hits = np.flatnonzero(np.isclose(places, value, rtol=1e-9, atol=1e-12))
        if not hits.size:
            listed = ", ".join(f"{place:g}" for place in places)
            key = "fields: [...]" if name == "d" else "output.fields: true"
            allowed = f"must be one of {listed}" if listed else f"was not written; the case needs `{key}` for fields"
            raise InputError("fields", name, value, allowed)
        index = int(hits[0])
        return grid_of(self._frames[index] if self.folder is None else read_frame(self._path, index))

    def in_memory(self) -> Self:
        """Read all files into memory, so that the folder can be removed.

        Returns:
            The result itself, with `folder` set to None.
        """
        for name in ("record", "case", "_tables", "_frame_times", "_frames"):
            getattr(self, name)
        self.folder = None
        return self

    def _headline(self) -> str:
        reason = f" ({self.reason})" if self.reason not in ("", "end") else ""
        where = f", {self.folder}" if self.folder is not None else ""
        return f"pairsim {self.kind}: {self.status}{reason}, {len(self.table)} rows{where}"

    def __repr__(self) -> str:
        return f"<{self._headline()}>"

    def _repr_html_(self) -> str:
        warnings = "".join(f"<li>{escape(warning)}</li>" for warning in self.warnings)
        notes = f"<ul>{warnings}</ul>" if warnings else ""
        table = self.table.to_html(max_rows=SHOWN, index=False)
        return f"<p><b>{escape(self._headline())}</b><br>{escape(self.message)}</p>{notes}{table}"


class RunResult(Result):
    """The result of a run in time. `table` is series.csv, with a row for each accepted step."""

    @property
    def times(self) -> Array:
        """Times at which there are fields [D_c/U_av], shape (n,)."""
        return self._frame_times

    def fields(self, t: float) -> pv.UnstructuredGrid:
        """Velocity, pressure, displacement and stresses on the deformed mesh, as a pyvista grid.

        Args:
            t: One of `times` [D_c/U_av].

        Raises:
            InputError: There are no fields at this time.
        """
        return self._fields("t", t)


class CurveResult(Result):
    """A master curve. `table` is curve.csv, with a row for each point."""

    @cached_property
    def zeros(self) -> pd.DataFrame:
        """The zeros of dU (equilibria.csv): d, stable, slope, peak, d_error and certain."""
        from pairsim.results.tables import empty_table

        found = self._tables["equilibria"]
        return found if len(found.columns) else empty_table(EQUILIBRIA_COLUMNS)

    def dU(self, d: Any, gap: int = 1) -> Any:
        """dU at any distance of the curve [U_av]; see `curve`, which returns the half-width of its interval, too."""
        return self.curve(d, gap)[0]

    def curve(self, d: Any, gap: int = 1) -> tuple[Any, Any]:
        """The interpolated dU at any distance of the curve, and the half-width of its interval.

        The interpolant is a cubic Hermite spline over log d; the half-width contains the errors of dU at the points and
        that of the interpolation between them.

        Args:
            d: Distance or array of distances [D_c], of any shape.
            gap: Number of the gap, counted from upstream.

        Returns:
            dU and its half-width [U_av]: numbers if `d` is one, else arrays of the shape of `d`.

        Raises:
            InputError: A distance is outside the curve, or there is no curve over a single distance.
        """
        columns = self._columns()
        found = curve_of(columns, "" if gap == 1 and "dU" in columns else f"_{gap}")
        if found is None:
            allowed = "must be a gap of a curve with at least two points over a single distance"
            raise InputError("curve", "gap", gap, allowed)
        wanted, (low, high) = np.asarray(d, dtype=float), found.d[[0, -1]]
        outside = wanted[~((wanted >= low) & (wanted <= high))]
        if outside.size:
            allowed = f"must be from {low:g} to {high:g}, the ends of the curve"
            raise InputError("curve", "d", float(outside.flat[0]), allowed)
        values = found.values(wanted), found.half_widths(wanted)
        return (float(values[0]), float(values[1])) if wanted.ndim == 0 else values

    @property
    def distances(self) -> Array:
        """Distances at which there are fields [D_c], shape (n,); see `fields` of the case."""
        return self._frame_times

    def fields(self, d: float) -> pv.UnstructuredGrid:
        """Velocity, pressure, displacement and stresses on the deformed mesh, as a pyvista grid.

        Args:
            d: One of `distances` [D_c].

        Raises:
            InputError: There are no fields at this distance.
        """
        return self._fields("d", d)

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


def result_of(command: Command[Any], folder: Path, ending: Mapping[str, Any] | None = None) -> Any:
    """The result of a command in a folder; arguments as for `Result`."""
    return TYPES.get(command.name, Result)(folder, command, ending)

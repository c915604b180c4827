"""Results of a computation: tables, fields, status and warnings, from a folder."""

from __future__ import annotations

import re
import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from pairsim.cases.experiment import Experiment
from pairsim.cases.quantity_text import A_LENGTH, si
from pairsim.cases.unit_registry import as_texts, has_unit
from pairsim.cases.yaml_file import read_yaml
from pairsim.computing.events import Outcome
from pairsim.computing.loading import case_of
from pairsim.computing.pictures import draw, page_of
from pairsim.computing.question import Question, Tables
from pairsim.computing.result_content import Content, files_in
from pairsim.quantities.measurable import a_time
from pairsim.record.columns import DISTANCE
from pairsim.record.folder import CHECKPOINT, WAY
from pairsim.record.record import Record
from pairsim.runtime.errors import (
    OF_MACHINE,
    BranchEnd,
    BudgetSpent,
    InputError,
    TooManySteps,
    WallTime,
    failure_of,
    happened_and_advice,
)
from pairsim.runtime.locks import is_locked
from pairsim.runtime.text import counted, duration, pasteable

if TYPE_CHECKING:
    import pandas as pd
    import pyvista as pv

    from pairsim.cases.case import SceneCase
    from pairsim.quantities.scales import Scales
    from pairsim.record.table import Table
    from pairsim.runtime.arrays import Array

SYMBOLS = {
    r"\bdU": "dU is the velocity of the leading particle minus that of the trailing one",
    r"\bD(_[LT\d]+)? ": "D, the Taylor parameter, is (length - height)/(length + height) of a particle, 0 of a sphere",
}
"""Explanations of symbols in answers, by the patterns that find them."""
UNITS = {
    "": "lengths are in tube diameters D_c, velocities in the mean velocity U_av, times in D_c/U_av",
    "pressure": "pressures in eta_0 U_av/D_c",
}
"""Units of dimensionless numbers in answers, by words that occur there."""
WARNING = "Warning: "  # begins the lines of an answer that are warnings
CASE_NOT_AT_FAULT = ("interrupted", *OF_MACHINE)
"""Reasons for which the same command may succeed."""
KILLED = Outcome("interrupted", "interrupted", "the command was killed")
"""The outcome of a command whose run.json says that it is running, although no process is at work on it."""


class Result:
    """The result of a computation; returned by the functions of questions such as `curve`, and by `open`.

    Its data are those of a folder, whose files are read once, when first accessed, or its `content`, from which a
    folder is made if one is needed. To see the progress of a running computation, `open` its folder again. If an
    `ending` is given, it replaces status, reason and message of run.json: a sweep also records crashes and timeouts. A
    result that is pickled keeps its tables, its record and its case.

    Attributes:
        folder: The folder; None if there is none, or a temporary one that is removed with the result.
        question: The question that was computed.
        source: The name by which messages refer to it.
    """

    def __init__(
        self,
        question: Question[Any],
        folder: Path | None = None,
        ending: Outcome | None = None,
        *,
        temporary: bool = False,
        content: Content | None = None,
        source: str = "",
    ) -> None:
        self.folder = None if temporary else folder
        self.question, self._ending, self._content = question, ending, content
        self.source = source or str(folder)
        if folder is not None and (content is None or folder.is_dir()):
            self._place = folder
        if folder is not None and temporary:
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

    @cached_property
    def _place(self) -> Path:
        """The folder with the files of the result, which are written when a result without one needs them."""
        assert self._content is not None, "a result has a folder or its content"
        place = Path(tempfile.mkdtemp(prefix="pairsim-"))
        weakref.finalize(self, shutil.rmtree, place, ignore_errors=True)
        self._content.write(place, self.kind)
        return place

    def __reduce__(self) -> Any:
        made = partial(type(self), content=self._packed(), source=self.source)
        return made, (self.question, self.folder, self._ending)

    def _packed(self) -> Content | None:
        """Its data, with all files of a temporary folder; None if its folder does not exist or has no tables."""
        if self._content is None and not self._place.is_dir():
            return None
        tables: dict[str, dict[str, Array]] = {}
        case = None
        with suppress(InputError):
            tables = {name: dict(table) for name, table in self.tables.items()}
        with suppress(InputError):
            case = self.case
        of_temporary = self.folder is None and "_place" in vars(self)
        return Content(tables, self.record, case, files_in(self._place) if of_temporary else {}) if tables else None

    @cached_property
    def record(self) -> Record:
        """The content of run.json: outcome, cost, versions and machine; empty if the file is missing or invalid."""
        return Record.read(self._place) if self._content is None else self._content.record

    @cached_property
    def table(self) -> pd.DataFrame:
        """The main table, with the columns of its CSV file (see the reference).

        Counts are integers; `table.attrs["units"]` has the unit of each column.
        """
        from pairsim.record.tables import frame_of

        return frame_of(self.columns)

    @cached_property
    def columns(self) -> Table:
        """The columns of the main table as arrays by name."""
        return self.tables[self.question.table]

    @cached_property
    def tables(self) -> Tables:
        """The columns of all tables as arrays by name, by the name of the table."""
        if self._content is None:
            return self.question.read_tables(self._place)
        from pairsim.record.table import Table  # loads numpy

        return {name: Table(self._content.tables.get(name), columns) for name, columns in self.question.tables.items()}

    @property
    def scales(self) -> Scales:
        """The units of length, velocity and viscosity in SI units; also `scales.time` and `scales.stress`.

        Raises:
            InputError: The case has no `physical` block.
        """
        return self.record.scales_of(self.source)

    def frame(
        self, name: str | None = None, *, physical: bool | None = False, at: Sequence[float | str] = ()
    ) -> pd.DataFrame:
        """A table, as `pairsim table` shows it.

        Args:
            name: Its name without .csv, such as "equilibria"; the main one by default.
            physical: Whether to convert to um, s, um/s and Pa; None if the case has a `physical` block.
            at: Distances of a curve, numbers [D_c] or texts such as "8um", for dU and its error there.

        Raises:
            InputError: There is no such table or distance, or `physical` is set and the case has no `physical` block.
        """
        from pairsim.record.tables import frame_of, in_units

        name = self.question.table_named(name, self.source)
        scales = None if physical is False else self.scales if physical else self.record.scales
        table = self._table_named(name)
        if at:
            from pairsim.analysis.master_curve import Curve

            table = Curve(table, {}, self.record, self.source).at(at)
        frame = frame_of(table)
        if scales is not None:
            try:
                frame = in_units(frame, table.declared, self.scales_of_rows(table, scales))
            except TypeError as error:
                file = str(self._place / f"{name}.csv")
                raise InputError(file, "", None, f"must have numbers in its rows ({error})") from None
            frame = self._with_quantity(frame, scales)
        frame.attrs["units"] |= {column: unit for column, unit in self.own_units.items() if column in frame}
        return frame

    @property
    def own_units(self) -> Mapping[str, str]:
        """The units of columns whose values are in the units of the case file, by name; empty without such columns."""
        return {}

    def _table_named(self, name: str) -> Table:
        """A table; if the result is that of a folder, the folder must have it.

        Raises:
            InputError: The folder does not have it.
        """
        if self._content is not None or self.tables[name]:
            return self.tables[name]
        from pairsim.record.table_files import read_table

        return read_table(self._place / f"{name}.csv", self.question.tables[name])  # says what is missing

    def scales_of_rows(self, table: Table, scales: Scales) -> list[Scales]:
        """The units of each row of a table: those of the case, unless rows belong to different values of a quantity."""
        return [scales] * table.rows

    def _with_quantity(self, frame: pd.DataFrame, scales: Scales) -> pd.DataFrame:
        """Insert the quantity of the experiment that gives the number which is followed, if there is one."""
        case = read_yaml(self._place / "case.yaml") if self._content is None else self.case.resolved()
        along = case.get("along")  # a list of values of Ca_e (shape, pressure), or a key with its values
        number = "Ca_e" if isinstance(along, list) else next(iter(along if isinstance(along, Mapping) else ()), "")
        experiment = Experiment.in_case(case)
        if experiment is not None and number in frame and number != DISTANCE.name:  # a distance has its unit already
            from pairsim.analysis.input_ranges import quantity_for

            key, unit, value_of = quantity_for(experiment, number, scales)
            frame.insert(list(frame).index(number), key, value_of(frame[number]))
            frame.attrs["units"][key] = unit
        return frame

    @property
    def physical(self) -> pd.DataFrame:
        """The main table in um, s, um/s and Pa; see `frame`."""
        return self.frame(physical=True)

    @property
    def kind(self) -> str:
        """Name of the command."""
        return self.question.name

    @cached_property
    def case(self) -> SceneCase:
        """The case, with every default filled in.

        Raises:
            InputError: case.yaml is missing, or not valid in this version.
        """
        if self._content is not None and self._content.case is not None:
            return self._content.case
        return case_of(self.question, self._place / "case.yaml")

    @cached_property
    def _outcome(self) -> Outcome:
        """Status, reason and message; a command is no longer running if nobody has locked its folder."""
        record = self.record
        found = self._ending or Outcome(record.status or "running", record.reason, record.message)
        return KILLED if found.status == "running" and not is_locked(self._place) else found

    @property
    def status(self) -> str:
        """One of "finished", "failed", "interrupted" (or killed) or "running"."""
        return self._outcome.status

    @property
    def reason(self) -> str:
        """Why it ended: "end", "contact", "max_gap", "interrupted", or the `reason` of a `RunFailure`."""
        return self._outcome.reason

    @property
    def message(self) -> str:
        """One line of text on how it ended."""
        return str(self._outcome.message)

    @property
    def warnings(self) -> list[str]:
        """Warnings about the results."""
        return list(self.record.warnings)

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
        """The answer in words, a line or more: what the particles do, how fast, the warnings and the cost.

        If the computation has not finished, it says why not, and what to do next.
        """
        warnings = [f"{WARNING}{warning}" for warning in self.warnings]
        ended = [] if self.status == "finished" else [f"{self.status.capitalize()}: {self.happened}".removesuffix(": ")]
        after = [self.advice] if ended and self.folder is not None and self.status != "running" else []
        if proven := self.reason == BranchEnd.reason:
            ended = [f"There is no steady state: {self.message}."]
        known = self._content is not None or self._place.is_dir()
        found = self.findings() if known and (self.columns.rows or not proven) else []
        symbols = self._symbols("\n".join(found)) if self.folder is not None and self.columns.rows else []
        return "\n".join([*ended, *found, *symbols, *warnings, *self._cost(), *after])

    @property
    def happened(self) -> str:
        """How it ended; if it has a folder, without what to try next, which `advice` has."""
        return self.message if self.folder is None else happened_and_advice(self.message)[0]

    def findings(self) -> list[str]:
        """The findings of the tables in words, a line each; each question has its own."""
        return []

    def _symbols(self, text: str) -> list[str]:
        """The meaning of the symbols in a text and, without a `physical` block, the units of its numbers."""
        said = [words for pattern, words in SYMBOLS.items() if re.search(pattern, text)]
        if self.record.scales is None:
            said.append(", ".join(words for pattern, words in UNITS.items() if pattern in text))
        return [f"Here {'; '.join(said)}."] if said else []

    def _cost(self) -> list[str]:
        """Wall time and work."""
        if (record := self.record).wall_time is None:
            return []
        counts = {"step": record.steps, "point": record.points}
        parts = [counted(count, noun) for noun, count in counts.items() if count is not None]
        parts += [f"{record.unknowns:,} unknowns"] if record.unknowns is not None else []
        work = f" ({', '.join(parts)})" if parts else ""
        return [f"Took {duration(float(record.wall_time))}{work}."]

    def afterwards(self) -> str:
        """What to do next if it has finished."""
        if not self.question.captions:
            return f"pairsim table {pasteable(self.source)} prints it"
        return f"pairsim plot {pasteable(self.source)} draws it again"

    @property
    def advice(self) -> str:
        """What to do next, in a line."""
        directory, reason = pasteable(self.source), self.reason
        if reason == BranchEnd.reason:
            drawn = " and fields.png the last shapes" if (self._place / "fields.png").exists() else ""
            way = self._place / WAY
            known = f"; {way} has the steady states on the way{drawn}" if way.exists() else ""
            return f"Next: a smaller Ca_e or De{known}."
        if self.status == "finished":
            return f"Next: {self.afterwards()}."
        resumes = self.question.resumable and (self._place / CHECKPOINT).is_file()
        if reason in (WallTime.reason, TooManySteps.reason):  # keys of `limits` as well
            return (
                f"Next: pairsim run --resume {directory} --set limits.{reason}=... continues from the last checkpoint."
            )
        if reason == BudgetSpent.reason and resumes:
            return f"Next: pairsim run --resume {directory} with a larger --budget continues from the last checkpoint."
        if reason == BudgetSpent.reason:
            return "Next: the same command with a larger --budget and --overwrite; what was written is kept until then."
        if reason not in CASE_NOT_AT_FAULT:
            _, advice = happened_and_advice(self.message)
            change = f"try {advice}; " if advice else ""
            return f"Next: {change}unchanged, the case fails in the same way. What was written is kept."
        if resumes:
            return f"Next: pairsim run --resume {directory} continues from the last checkpoint."
        return "Next: the same command with --overwrite computes it again; what was written is kept until then."

    def plot(
        self,
        folder: Path | str,
        *,
        formats: str | Sequence[str] | None = None,
        width: str | float = 170.0,
        field: str | None = None,
        animate: bool = False,
        physical: bool | None = None,
        legend: bool = True,
    ) -> list[Path]:
        """Draw the result into a folder, which is made if needed; options and errors are those of `pairsim.plot`."""
        page = page_of(formats, width, physical, legend, animate)
        return draw(self.question, self._place, Path(folder), page, field, animate)

    @cached_property
    def places(self) -> Array:
        """Times [D_c/U_av] (curve: distances [D_c]; focus: values followed) at which there are fields, shape (n,)."""
        from pairsim.record.xdmf import read_times

        return read_times(self._place)

    def fields(self, at: Any, *, physical: bool = False) -> pv.UnstructuredGrid:
        """Velocity, pressure, displacement and stresses on the deformed mesh, as a pyvista grid.

        Args:
            at: One of `places`: a time (curve: a distance; focus: a value followed), as a number, a text with a unit
                such as "15um", or a quantity of pint.
            physical: Whether to convert to um, um/s and Pa.

        Returns:
            Names and components are as in fields.xdmf: vectors are (z, r, 0), except for disturbances off the axis,
            which are (z, r, theta). Values are NaN where a field is not defined: the elastic stress in the liquid, and
            fields of the liquid alone in the particles. Cell data: `region`, 0 in the liquid and i in particle i from
            upstream. Field data: `t`, the time or distance.

        Raises:
            InputError: There are no fields there, or `physical` is set and the case has no `physical` block.
        """
        import numpy as np

        from pairsim.computing.fields_grid import grid_of
        from pairsim.record.xdmf import read_frame

        place = self._place_at(at)
        hits = np.flatnonzero(np.isclose(self.places, place, rtol=1e-9, atol=1e-12))
        if not hits.size:
            listed = ", ".join(f"{place:g}" for place in self.places)
            needs = f"was not written; for fields the case needs `{self.question.fields_key}`"
            allowed = f"must be one of {listed}" if listed else needs
            raise InputError("fields", self.question.frames, at, allowed)
        return grid_of(read_frame(self._place, int(hits[0])), self.scales if physical else None)

    def _place_at(self, at: Any) -> float:
        """A time or distance of `places` as a number, which may be given with its unit.

        Raises:
            InputError: It has none of these units, or the case has no `physical` block.
        """
        text = as_texts(at)
        if not has_unit(text):
            return float(text)
        try:
            return self._place_of(text)
        except ValueError as error:
            raise InputError("fields", self.question.frames, at, str(error)) from None

    def _place_of(self, text: str) -> float:
        """A time or distance of `places` from a text with its unit.

        Raises:
            ValueError: It has none of these units, or the case has no `physical` block.
        """
        of = a_time("time", "time") if self.question.frames == "t" else A_LENGTH
        return float(of.number(si(text, of), self.scales))

    def __repr__(self) -> str:
        reason = f" ({self.reason})" if self.reason not in ("", "end") else ""
        where = f", {self.folder}" if self.folder is not None else ""
        return f"<pairsim {self.kind}: {self.status}{reason}, {len(self.table)} rows{where}>"

"""The record of a question about one case: all that the rest of pairsim knows of it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from pairsim.physics.declared import FIELDS
from pairsim.record.column import Columns
from pairsim.record.columns import COST, STEPS, SWEEP_COLUMNS
from pairsim.record.folder import OWN_FILES, PICTURE_ENDINGS
from pairsim.record.record import Record
from pairsim.record.run_entries import Entry
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.cases.case import SceneCase
    from pairsim.cases.estimate import Estimate
    from pairsim.cases.mistakes import Mistake
    from pairsim.computing.events import Events
    from pairsim.plots.style import Page
    from pairsim.record.table import Table

Value = float | int | str | list[float] | list[bool] | None  # a value in results.csv
type Tables = Mapping[str, Table]
"""Tables of a folder by name; a table that the folder lacks has no columns."""


def last_row(tables: Tables, record: Record) -> dict[str, Value]:
    """The usual values of a case in results.csv: the number of rows of its main table, and its last row."""
    main = next(iter(tables.values()))
    last = {name: values[-1].item() for name, values in main.items() if len(values)}
    return {"points": main.rows, **last}


def no_pictures(folder: Path, out: Path, page: Page) -> list[Path]:
    """Draw nothing, for a question without pictures."""
    return []


def no_mistakes(case: SceneCase) -> Iterable[Mistake]:
    """Find no mistakes, for a question that allows every case that its keys allow."""
    return ()


@dataclass(frozen=True)
class InSweeps[C: SceneCase]:
    """The columns of results.csv that a sweep has for the cases of a question, beside their parameters and status."""

    columns: Callable[[C], Sequence[str]]  # names of the columns with the results of a case, which precede `COST`
    read: Callable[[Tables, Record], dict[str, Value]] = last_row  # reads their values from the content of a folder
    parameters: tuple[str, ...] = ("beta", "De", "Ca_e")  # keys that results.csv always has, also if they do not vary
    drawn: bool = False  # whether a sweep has pictures of them, beside those in the folders of its cases


@dataclass(frozen=True)
class Flag:
    """An option that not all questions have: a keyword of the computation, off by default.

    Attributes:
        name: The keyword, and with two hyphens the option of the command.
        help: What the option does, for --help.
        resumes: Whether the computation is resumed from the checkpoint of a folder. The option takes this folder in
            place of -o, and the case file is by default the one in it; the computation takes `earlier`, not the
            keyword.
    """

    name: str
    help: str
    resumes: bool = False


@dataclass(frozen=True)
class Question[C: SceneCase]:
    """A question about one case, whose results are in a folder.

    The command and the Python function are made from this record. Its functions import large libraries only when they
    are called, as `--help` and the report of a mistake in a case file need none.

    Attributes:
        module: Name of the module that has this record as `QUESTION`. The docstring of the module is the help of the
            command, and its first line that of the Python function.
        model: Keys of its case file; `model.kind` is its name.
        estimate: Estimates the size and the duration of a case.
        solve: Its computation, a generator of the events in `computing/events.py`: takes the case, and as keywords its
            `monitor`, its flags, and `earlier` to resume.
        tables: Its tables by name without .csv, the main one first, with the columns that they may have.
        entries: The entries that its computation adds to run.json.
        result: Class of its results, derived from `pairsim.computing.result.Result`, with what these have beside
            tables, and with the answer in words.
        in_sweeps: What results.csv of a sweep has of it.
        examples: The end of the help, such as "Example: pairsim shape case.yaml".
        check: Yields mistakes in keys that other kinds of cases share. What the question's own keys require of others
            is declared with them (`cases/keys.py`).
        draw: Draws the tables of a folder into another folder, and returns the pictures.
        captions: Caption of each of these pictures in a report, by the name of its file.
        frames: The quantity at whose values fields are written: "t", "d", "value" for the parameter that it follows, or
            "" if it writes no fields. Fields at "value" are drawn by `draw`, those of runs and curves elsewhere.
        flags: The options that it has beside those of all questions.
        shared: Whether its computation takes `workers`, too, with which it shares its work; it then has --workers.
        draws_from: Least number of rows of its main table for which pictures are drawn at its end; None: never.
    """

    module: str
    model: type[C]
    estimate: Callable[[C], Estimate]
    solve: Callable[..., Events]
    tables: Mapping[str, Columns]
    result: type[Any]
    in_sweeps: InSweeps[C]
    examples: str
    check: Callable[[C], Iterable[Mistake]] = no_mistakes
    draw: Callable[[Path, Path, Page], list[Path]] = no_pictures
    captions: Mapping[str, str] = field(default_factory=dict)
    frames: str = ""
    flags: tuple[Flag, ...] = ()
    entries: tuple[Entry[Any], ...] = ()
    draws_from: int | None = 1
    shared: bool = False

    def __reduce__(self) -> Any:
        """Pickle it as a reference to its module."""
        return resolve_name, (f"{self.module}:QUESTION",)

    @property
    def help(self) -> str:
        """The help of its command; the first line says what it computes."""
        return str(sys.modules[self.module].__doc__)

    @property
    def name(self) -> str:
        """Its name on the command line and in Python."""
        return self.model.kind

    @property
    def fields_are_drawn(self) -> bool:
        """Whether its fields are drawn as those of runs and curves are."""
        return self.frames in ("t", "d")

    @property
    def fields_key(self) -> str:
        """The key in its case files that asks for fields."""
        return {"d": "fields: [...]", "value": "fields: true"}.get(self.frames, "output.fields: true")

    @property
    def table(self) -> str:
        """The name of its main table."""
        return next(iter(self.tables))

    def table_named(self, name: str | None, source: str) -> str:
        """The name of a table, of the main one for None.

        Raises:
            InputError: There is no such table; the message names `source`.
        """
        if name is not None and name not in self.tables:
            allowed = f"must be {' or '.join(self.tables)}, a table of `pairsim {self.name}`"
            raise InputError(source, "", name, allowed)
        return name or self.table

    @property
    def sweep_columns(self) -> Columns:
        """The columns that results.csv of a sweep of it may have."""
        return Columns(SWEEP_COLUMNS, self.tables[self.table])

    @property
    def resumable(self) -> bool:
        """Whether its computation can be resumed from a checkpoint."""
        return any(flag.resumes for flag in self.flags)

    def has_flag(self, name: str) -> bool:
        """Whether it has a certain option."""
        return any(flag.name == name for flag in self.flags)

    def read_tables(self, directory: Path) -> Tables:
        """Its tables in a folder.

        Raises:
            InputError: A file is not a table of pairsim.
        """
        from pairsim.record.table_files import read_table

        files = {name: (directory / f"{name}.csv", columns) for name, columns in self.tables.items()}
        return {name: read_table(path, columns, missing_ok=True) for name, (path, columns) in files.items()}

    def values(self, directory: Path) -> dict[str, Value]:
        """Values of a folder for the columns of results.csv; only its costs if a table cannot be read."""
        record, values = Record.read(directory), dict[str, Value]()
        with suppress(InputError, ValueError, KeyError):
            tables = self.read_tables(directory)
            if tables[self.table]:
                values = self.in_sweeps.read(tables, record)
        return values | record.cost(STEPS, *COST)


def own_files(questions: Iterable[Question[Any]]) -> Iterator[str]:
    """Yield the names of all files of questions in folders, except single frames of fields; imports the questions."""
    known = list(questions)
    tables = (f"{name}.csv" for question in known for name in question.tables)
    drawn = [*(name for question in known for name in question.captions), *(f"field-{name}" for name in FIELDS)]
    pictures = (f"{name}.{end}" for name in drawn for end in PICTURE_ENDINGS)
    yield from dict.fromkeys((*OWN_FILES, *tables, *pictures))

"""The folder of a sweep: sweep.json lists its cases, and the folders of the cases say how far each has come.

sweep.json is written once, when the sweep begins, and does not record its progress.
"""

from __future__ import annotations

import json
import os
import platform
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NotRequired, TypedDict

from pairsim.cases.yaml_file import yaml_text
from pairsim.computing.question import Question, Value
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import plain, write_json, write_text
from pairsim.record.record import Record
from pairsim.runtime.errors import Argument, BranchEnd, InputError
from pairsim.runtime.locks import command_line, is_locked
from pairsim.runtime.plain import Plain
from pairsim.runtime.version import __version__
from pairsim.sweeps.grid import Grid

RECORD = "sweep.json"
STOP = ".stop"  # file in the folder of a sweep whose presence stops it
STATUSES = ("pending", "running", "finished", "failed")
ENDED = ("finished", "failed")


@dataclass(frozen=True)
class CaseState:
    """The state of a case."""

    folder: str  # its name
    status: str = "pending"  # "pending", "running", "finished" or "failed"
    reason: str = ""  # as in run.json
    message: str = ""  # as in run.json
    warnings: Sequence[str] = ()  # what its run.json warns of
    values: Mapping[str, Value] = field(default_factory=dict)  # what it gives to results.csv


def read_state(directory: Path, key: str, values: bool = True) -> CaseState:
    """The state of a case as read from its folder; its tables are read only if `values` are wanted.

    The case is pending if its folder has the hash of another case, or if its computation has not begun or was
    interrupted. Records of version 0.2, which have no hash, are accepted.
    """
    record = Record.read(directory)
    if record.key not in (None, key) or record.status not in ("running", *ENDED):
        return CaseState(directory.name)
    known = QUESTIONS[record.kind].values(directory) if values and record.status in ENDED else {}
    return CaseState(directory.name, record.status, record.reason, record.message, record.warnings, known)


@dataclass
class SweptCase:
    """A case of a sweep and its state.

    Attributes:
        key: Hash of the case.
        parameters: The values of the keys that vary, and of those that results.csv always has.
        state: Its state.
    """

    key: str
    parameters: Mapping[str, Plain]
    state: CaseState

    @property
    def folder(self) -> str:
        """The name of its folder."""
        return self.state.folder

    @property
    def without_result(self) -> bool:
        """Whether it failed, or has no steady state."""
        return self.state.status == "failed" or self.state.reason == BranchEnd.reason


class CaseEntry(TypedDict):
    """The entry of a case in sweep.json."""

    folder: str
    key: str
    parameters: Mapping[str, Plain]


class SweepContent(TypedDict):
    """The entries of sweep.json."""

    name: str
    command: str  # the question
    grid: NotRequired[str]  # hash of the set of cases
    varying: Sequence[str]
    parameters: Sequence[str]
    columns: Sequence[str]
    command_line: NotRequired[str]
    working_folder: NotRequired[str]
    machine: NotRequired[Mapping[str, str]]
    versions: NotRequired[Mapping[str, str]]
    cases: Sequence[CaseEntry]


@dataclass(frozen=True)
class SweepRecord(Mapping[str, object]):
    """The content of sweep.json and the states of its cases, as attributes and as a mapping.

    In the mapping, the entries of a case are those of sweep.json and of its `CaseState`, and `counts` is the number of
    cases by status.
    """

    content: SweepContent
    cases: Sequence[SweptCase]

    @classmethod
    def of(cls, content: SweepContent) -> SweepRecord:
        """The record of sweep.json alone: no case has begun."""
        listed = content["cases"]
        return cls(content, [SweptCase(each["key"], each["parameters"], CaseState(each["folder"])) for each in listed])

    def __getitem__(self, name: str) -> object:
        if name == "cases":
            return [{"key": each.key, "parameters": each.parameters, **vars(each.state)} for each in self.cases]
        entries: Mapping[str, object] = self.content
        return self.counts if name == "counts" else entries[name]

    def __iter__(self) -> Iterator[str]:
        return iter((*self.content, "counts"))

    def __len__(self) -> int:
        return len(self.content) + 1

    @property
    def name(self) -> str:
        """The name of the sweep."""
        return self.content["name"]

    @property
    def question(self) -> Question[Any]:
        """The question that each case asks."""
        return QUESTIONS[self.content["command"]]

    @property
    def grid(self) -> str | None:
        """Hash of the set of cases; None in sweeps of versions that wrote none."""
        return self.content.get("grid")

    @property
    def varying(self) -> Sequence[str]:
        """The keys that vary."""
        return list(self.content["varying"])

    @property
    def parameters(self) -> Sequence[str]:
        """The keys of which results.csv has columns."""
        return list(self.content["parameters"])

    @property
    def columns(self) -> Sequence[str]:
        """The columns of results.csv with results of the cases."""
        return list(self.content["columns"])

    @property
    def versions(self) -> Mapping[str, str]:
        """The versions of the program and of Python, by name."""
        return dict(self.content.get("versions", {}))

    @property
    def counts(self) -> dict[str, int]:
        """The number of cases by status."""
        count = Counter(case.state.status for case in self.cases)
        return {status: count[status] for status in STATUSES}

    @property
    def ended(self) -> list[SweptCase]:
        """The cases that have ended, in the order of the grid."""
        return [case for case in self.cases if case.state.status in ENDED]

    @property
    def without_result(self) -> list[SweptCase]:
        """The cases that failed, or have no steady state."""
        return [case for case in self.cases if case.without_result]

    def results(self) -> tuple[list[str], list[list[Any]]]:
        """Columns and rows of results.csv: a row for each case that has ended."""
        rows = [
            [
                *(case.state.folder, case.state.status, case.state.reason),
                *(case.parameters.get(key) for key in self.parameters),
                *(case.state.values.get(key) for key in self.columns),
                "; ".join(case.state.warnings),
            ]
            for case in self.ended
        ]
        return ["folder", "status", "reason", *self.parameters, *self.columns, "warnings"], rows


def begin(directory: Path, grid: Grid) -> SweepRecord:
    """Write sweep.json and grid.yaml into a folder, unless it has them; returns the record, with all cases pending.

    Raises:
        InputError: The folder belongs to another grid, or has files but is not that of a sweep.
        OSError: The files cannot be written.
    """
    if (directory / RECORD).is_file():
        earlier = _read(directory)
        if earlier.grid != grid.key:
            version = earlier.versions.get("pairsim", __version__)
            other = f"by pairsim {version}, whose keys or defaults differ: CHANGELOG.md says what to write"
            whose = "of another grid" if version == __version__ else other
            raise InputError(
                str(directory), Argument("folder"), None, f"must be a folder for this grid, but has a sweep {whose}"
            )
        return earlier
    if any(not path.name.startswith(".") for path in directory.iterdir()):
        raise InputError(str(directory), Argument("folder"), None, "must be a new or empty folder, or one of a sweep")
    content: SweepContent = {
        "name": grid.name,
        "command": grid.question.name,
        "grid": grid.key,
        "varying": grid.varying,
        "parameters": [*dict.fromkeys((*grid.varying, *grid.question.in_sweeps.parameters))],
        "columns": grid.columns,
        "command_line": command_line(),
        "working_folder": os.getcwd(),
        "machine": {"node": platform.node(), "system": platform.platform()},
        "versions": {"pairsim": __version__, "python": platform.python_version()},
        "cases": [
            {"folder": each.folder, "key": each.key, "parameters": plain(each.parameters)} for each in grid.cases
        ],
    }
    text = "".join(f"# --set {each}\n" for each in grid.settings) + yaml_text(plain(grid.content))
    write_json(directory / RECORD, content)
    write_text(directory / "grid.yaml", text)
    return SweepRecord.of(content)


def _read(directory: Path) -> SweepRecord:
    path = directory / RECORD
    try:
        return SweepRecord.of(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise InputError(str(directory), "", None, "must be the folder of a sweep, but has no sweep.json") from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(str(path), "", None, f"must be the record of a sweep of this version ({error})") from error


def read_sweep(directory: Path, values: bool = True) -> SweepRecord:
    """The record of a sweep with the present state of each case.

    The tables of the cases are read only if `values` are wanted.

    Raises:
        InputError: The folder is not that of a sweep.
    """
    record = _read(directory)
    working = is_locked(directory)
    for case in record.cases:
        case.state = read_state(directory / case.folder, case.key, values)
        if case.state.status == "running" and not working:  # it was killed
            case.state = replace(case.state, status="pending")
    return record

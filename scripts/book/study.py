"""Studies: what is computed in parts, stored row by row, and judged.

A study is a folder of scripts/studies whose package has a `STUDY`. `scripts/study` computes its parts, stores their
rows with a hash of the code that they depend on, says which statements hold, and writes its page.
"""

from __future__ import annotations

import importlib
import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

import pairsim
from book.code import code_of
from book.statements import Judged
from pairsim.cases.case import SceneCase
from pairsim.cases.identity import identity_of, key_of
from pairsim.runtime.locks import command_line
from pairsim.sweeps.task import Task, compute

STUDIES = Path(__file__).resolve().parents[1] / "studies"
type Row = Mapping[str, str | float | bool | None]


class Stopped(Exception):
    """A part was stopped before it was computed; the next command computes it."""


class Unavailable(Exception):
    """A part needs something that is not installed, such as another code; the message says what. It is left out."""


@dataclass(frozen=True)
class Part:
    """A unit of computation, whose rows are stored as soon as it is done.

    Attributes:
        name: Its name, which no other part of the study has.
        identity: What is computed, as text: a stored result of another identity does not belong to this part.
        compute: Computes it in a folder of its own, which is empty at first; returns rows of the results, at least one.
        uses: Packages and modules whose code its rows depend on; if empty, they are those of the study.
    """

    name: str
    identity: str
    compute: Callable[[Path], Sequence[Row]]
    uses: tuple[str, ...] = ()


@dataclass(frozen=True)
class Study:
    """A study.

    Attributes:
        folder: Its folder, with the stored results.
        shows: What it shows, in a sentence.
        uses: Packages and modules whose code its results depend on, except those of parts that name their own.
        parts: Returns its parts in the order in which they are computed; with True those of the quick form.
        statements: Returns what it states, judged by the stored rows, which are those of the parts given.
        blocks: Returns the text between the marks of its page, likewise, by the names of the marks.
        page: The page. Several studies may have marks on one.
        files: Returns the content of other files that are made from the stored rows, by path: pictures, tables that
            ship.
        pictures: The folder of pictures of what is not stored, such as fields: each part may leave one, under its name,
            in its own folder.
    """

    folder: Path
    shows: str
    uses: Sequence[str]
    parts: Callable[[bool], Sequence[Part]]
    statements: Callable[[pd.DataFrame, Sequence[Part]], Mapping[str, Judged]]
    blocks: Callable[[pd.DataFrame, Sequence[Part]], Mapping[str, str]]
    page: Path
    files: Callable[[pd.DataFrame, Sequence[Part]], Mapping[Path, str | bytes]] = lambda *_: {}
    pictures: Path | None = None

    @property
    def name(self) -> str:
        """The name of its folder."""
        return self.folder.name

    @property
    def stored(self) -> Path:
        """The file of its stored results."""
        return self.folder / "results.csv"

    def code_of(self, part: Part) -> str:
        """The code on which the rows of one of its parts depend, with hashes."""
        return code_of(part.uses or self.uses)


def names() -> list[str]:
    """The names of all studies."""
    return sorted(path.parent.name for path in STUDIES.glob("*/__init__.py"))


def study_of(name: str) -> Study:
    """The study of a name."""
    found: Study = importlib.import_module(f"studies.{name}").STUDY
    return found


def computed(
    question: str, case: Mapping[str, Any], folder: Path, seconds: float, flags: Mapping[str, bool] | None = None
) -> Any:
    """The result of a case, computed in a child process; where it has failed its status and reason say so.

    Each thread has a child process of its own, which computes one case after the other.

    Args:
        question: Such as "shape".
        case: Keys and values.
        folder: Where its files are written.
        seconds: Wall time after which it is stopped.
        flags: Options of the question, such as "sensitivities" of a curve.

    Raises:
        InputError: A key or value is not allowed.
        Stopped: The study was stopped.
    """
    return solved(question, pairsim.load(case, kind=question), folder, seconds, flags)


def solved(
    question: str, case: SceneCase, folder: Path, seconds: float, flags: Mapping[str, bool] | None = None
) -> Any:
    """The same as `computed` for a validated case; a result that is finished already is read from its folder."""
    key = key_of(question, identity_of(case))
    state = compute(Task(folder, question, key, pickle.dumps(case), command_line(), seconds, {}, flags or {}))
    if state.status == "pending":
        raise Stopped
    return pairsim.open(folder)

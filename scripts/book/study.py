"""Studies: what is computed in parts, stored row by row, and judged.

A study is a folder of scripts/studies whose package has a `STUDY`. `scripts/study` computes its parts, stores their
rows with the name of the code that they depend on, says which statements hold, and writes its page.
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
from book.statements import Judged
from pairsim.cases.identity import identity_of, key_of
from pairsim.runtime.locks import command_line
from pairsim.sweeps.task import Task, compute

STUDIES = Path(__file__).resolve().parents[1] / "studies"
type Row = Mapping[str, str | float | bool | None]


class Stopped(Exception):
    """A part was stopped before it was computed, and is computed by the next command."""


@dataclass(frozen=True)
class Part:
    """What is computed as one, and stored as soon as it is done.

    Attributes:
        name: Its name, which no other part of the study has.
        identity: What is computed, as text: a stored result of another identity is none of this part.
        compute: Computes it in a folder of its own, which it finds empty; returns rows of the results, at least one.
        uses: Packages and modules whose code its rows depend on; none are those of the study.
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
        uses: Packages and modules whose code its results depend on, but for parts that say so themselves.
        parts: Its parts in the order in which they are computed; with True those of the quick form.
        statements: What it states, judged by the stored rows, which are those of the parts given.
        blocks: What stands between the marks of its page, likewise.
        page: The page.
    """

    folder: Path
    shows: str
    uses: Sequence[str]
    parts: Callable[[bool], Sequence[Part]]
    statements: Callable[[pd.DataFrame, Sequence[Part]], Mapping[str, Judged]]
    blocks: Callable[[pd.DataFrame, Sequence[Part]], Mapping[str, str]]
    page: Path

    @property
    def name(self) -> str:
        """The name of its folder."""
        return self.folder.name

    @property
    def stored(self) -> Path:
        """The file of its stored results."""
        return self.folder / "results.csv"


def names() -> list[str]:
    """The names of all studies."""
    return sorted(path.parent.name for path in STUDIES.glob("*/__init__.py"))


def study_of(name: str) -> Study:
    """The study of a name."""
    found: Study = importlib.import_module(f"studies.{name}").STUDY
    return found


def computed(question: str, case: Mapping[str, Any], folder: Path, seconds: float) -> Any:
    """The result of a case, computed in a child process; where it has failed its status and reason say so.

    Threads have children of their own, each of which computes one case after the other.

    Args:
        question: Such as "shape".
        case: Keys and values.
        folder: Where its files are written.
        seconds: Wall time after which it is stopped.

    Raises:
        InputError: A key or value is not allowed.
        Stopped: The study was stopped.
    """
    checked = pairsim.load(case, kind=question)
    key = key_of(question, identity_of(checked))
    task = Task(folder, question, key, pickle.dumps(checked), command_line(), seconds, {}, {})
    state = compute(task)
    if state.status == "pending":
        raise Stopped
    return pairsim.open(folder)

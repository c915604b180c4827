"""The questions: every file or folder beside this one that has a record `QUESTION`.

A file is imported only when its question is needed. Names and first lines are read from the text of the files.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.cases import kinds_of_cases as kinds
from pairsim.questions import __path__ as folders

if TYPE_CHECKING:
    from pairsim.computing.question import Question

FILES = ("[a-z]*.py", "[a-z]*/__init__.py")
RECORD = "\nQUESTION = "
"""The text by which the file of a question is recognised."""
ORDER = ("run", "curve", "critical")  # the questions that come first in lists; others follow by name


def _first_lines() -> dict[str, str]:
    """The first line of the file of each question, which says what it computes, by the name of the question."""
    found = dict[str, str]()
    for file in (file for folder in map(Path, folders) for part in FILES for file in folder.glob(part)):
        text = file.read_text(encoding="utf-8")
        if RECORD in text:
            name = file.parent.name if file.stem == "__init__" else file.stem
            found[name] = text.partition("\n")[0].lstrip("r").strip('"')
    return {name: found[name] for name in (*ORDER, *sorted(found.keys() - {*ORDER}))}


FIRST_LINES: Mapping[str, str] = _first_lines()
NAMES = tuple(FIRST_LINES)


class _Questions(Mapping[str, "Question[Any]"]):
    """The questions by name, which is that of their file, their command and their Python function."""

    def __getitem__(self, name: str) -> Question[Any]:
        if name not in FIRST_LINES:
            raise KeyError(name)
        question: Question[Any] = import_module(f"{__package__}.{name}").QUESTION
        return question

    def __contains__(self, name: object) -> bool:
        return name in FIRST_LINES

    def __iter__(self) -> Iterator[str]:
        return iter(FIRST_LINES)

    def __len__(self) -> int:
        return len(FIRST_LINES)


QUESTIONS: Mapping[str, Question[Any]] = _Questions()
kinds.LISTS.append(lambda: [question.model for question in QUESTIONS.values()])

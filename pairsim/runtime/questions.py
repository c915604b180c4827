"""The names of all questions, which are those of the files in `pairsim/questions`; a file is imported on demand."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from types import ModuleType

FOLDER = Path(__file__).parents[1] / "questions"
"""Where the questions are, each in the file or, if it is a long one, in the folder of its name."""
ORDER = ("run", "curve", "critical")  # the questions that come first in lists; others follow by name
NAMES = (*ORDER, *sorted({entry.stem for entry in FOLDER.glob("[a-z]*")} - {*ORDER}))


def module_of(name: str) -> ModuleType:
    """The module of a question."""
    return import_module(f"pairsim.questions.{name}")


def first_line(name: str) -> str:
    """The first line of the file of a question: what it computes."""
    file = FOLDER / f"{name}.py"
    with (file if file.exists() else FOLDER / name / "__init__.py").open(encoding="utf-8") as lines:
        return lines.readline().lstrip("r").strip('"\n')

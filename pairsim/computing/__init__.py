"""What questions share: their record, the session that carries them out, quasi-steady solutions, warnings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pairsim.computing.question import Question
from pairsim.results.folder import OWN_FILES, PICTURE_ENDINGS
from pairsim.runtime.questions import NAMES, module_of


class _Questions(Mapping[str, Question[Any]]):
    """The questions by name, which is that of their file; the file is imported when its question is asked for."""

    def __getitem__(self, name: str) -> Question[Any]:
        if name not in NAMES:
            raise KeyError(name)
        question: Question[Any] = module_of(name).QUESTION
        return question

    def __contains__(self, name: object) -> bool:
        return name in NAMES

    def __iter__(self) -> Iterator[str]:
        return iter(NAMES)

    def __len__(self) -> int:
        return len(NAMES)


QUESTIONS = _Questions()  # the questions by name, which is that of their command, too


def own_files() -> tuple[str, ...]:
    """Every file in a folder of results, but for single frames of fields; `--overwrite` removes only these."""
    from pairsim.physics.declared import FIELDS

    tables = (f"{name}.csv" for question in QUESTIONS.values() for name in question.tables)
    drawn = [name for question in QUESTIONS.values() for name in question.captions]
    pictures = (f"{name}.{end}" for name in (*drawn, *(f"field-{each}" for each in FIELDS)) for end in PICTURE_ENDINGS)
    return tuple(dict.fromkeys((*OWN_FILES, *tables, *pictures)))


__all__ = ["QUESTIONS", "Question", "own_files"]

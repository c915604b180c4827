"""The kinds of files that commands read, and the validation of those with many cases."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from pydantic import BaseModel, ValidationError

from pairsim.cases.messages import mistakes_of
from pairsim.cases.mistakes import Mistake, input_error
from pairsim.computing.case_files import Files, refuse_file_of_another_command
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.plain import Plain
from pairsim.sweeps.atlas_file import AtlasFile
from pairsim.sweeps.grid_file import SweepFile
from pairsim.sweeps.study_file import StudyFile

FILES = Files(QUESTIONS, {"sweep": SweepFile, "study": StudyFile, "atlas": AtlasFile})
"""The models of all kinds of files, by the command that reads them."""


def parse_file[T: BaseModel](
    command: str, model: type[T], check: Callable[[T], Iterator[Mistake]], data: Mapping[str, Plain], source: str
) -> T:
    """Validate the keys of a file of many cases, singly and against each other; its cases are not validated.

    Args:
        command: The command that reads such files.
        model: The model of their keys.
        check: Yields mistakes that involve several keys.
        data: The content of the file.
        source: The name of the file in messages.

    Raises:
        InputError: The file has mistakes, or is for another command.
    """
    refuse_file_of_another_command(data, command, FILES, source)
    try:
        file = model.model_validate(data)
        mistakes = list(check(file))
    except ValidationError as error:
        mistakes = mistakes_of(error, model, data)
    if mistakes:
        raise input_error(mistakes, data, source)
    return file

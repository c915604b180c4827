"""Read and validate case files; error messages use the keys of the file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from pairsim.cases.case import SceneCase
from pairsim.cases.cost import check_size
from pairsim.cases.mistakes import Mistake, input_error, without
from pairsim.cases.physical import InNumbers, forget_numbers
from pairsim.cases.wording import mistakes_of
from pairsim.cases.yaml_file import Section, apply_settings, read_yaml
from pairsim.computing import QUESTIONS, Question
from pairsim.computing.many_cases import StudyFile, SweepFile

OF_MANY: dict[str, type[BaseModel]] = {"sweep": SweepFile, "study": StudyFile}
FILES = (*QUESTIONS, *OF_MANY)
"""The kinds of files, by the command that reads them."""


def model_of(command: str) -> type[BaseModel]:
    """The model that defines the file of a command."""
    return OF_MANY[command] if command in OF_MANY else QUESTIONS[command].model


def read_case[C: SceneCase](command: Question[C], path: Path, overrides: tuple[str, ...] = ()) -> C:
    """Read and validate the case file of a command.

    Args:
        command: The command.
        path: The file.
        overrides: key=value settings (dotted keys) that replace or add keys of the file.

    Raises:
        InputError: The file cannot be read or has mistakes; lists file, line, key, value and what is allowed.
    """
    return parse_case(command, read_with(path, overrides), str(path))


def read_with(path: Path, overrides: tuple[str, ...]) -> Section:
    """Read a case file and apply key=value settings, without validating the case.

    Raises:
        InputError: The file cannot be read, or a setting is not of the form key=value.
    """
    data = read_yaml(path)
    forget_numbers(data)
    apply_settings(data, overrides)
    return data


def parse_case[C: SceneCase](command: Question[C], data: Mapping[str, Any], source: str, entry: str = "") -> C:
    """Validate the keys and values of a case: physical units, each key on its own, then the keys against each other.

    Args:
        command: The command that the case is for.
        data: Keys and values; those from `read_yaml` carry the line numbers for error messages.
        source: Name of the file in error messages.
        entry: Name of the case within a file of several cases, else empty.

    Raises:
        InputError: The case has mistakes; lists each wrong key, its value and what is allowed.
    """
    numbers = InNumbers(data, command.model.model_fields)
    case, wrong = _validated(command.model, numbers.data)
    if wrong and (other := file_of_another_command(data, command.name, bool(entry))) is not None:
        raise input_error([other], data, source, entry)
    if wrong and case is not None:
        # Checks that combine keys are unreliable where values are wrong: then only missing keys are reported.
        whole = all(mistake.is_unknown for mistake in wrong)
        wrong += [each for each in _others(command.check(case), wrong) if whole or each.is_missing]
    mistakes = numbers.mistakes(wrong)
    if case is not None and not mistakes:
        mistakes = numbers.mistakes(list(command.check(case)) or list(check_size(case)))
    if mistakes or case is None:
        raise input_error(mistakes, data, source, entry)
    return case


def _validated[M: BaseModel](model: type[M], data: Mapping[str, Any]) -> tuple[M | None, list[Mistake]]:
    """A file without the keys that are wrong on their own, None if too little of it is left, and their mistakes."""
    try:
        return model.model_validate(dict(data)), []
    except ValidationError as error:
        mistakes = mistakes_of(error, model, data)
    try:
        return model.model_validate(without(data, mistakes)), mistakes
    except ValidationError:
        return None, mistakes


def _others(found: Iterable[Mistake], mistakes: list[Mistake]) -> list[Mistake]:
    """Those found in the rest of a file, where keys with other mistakes were left out."""
    named = {_first(key) for mistake in mistakes for key in (mistake.key, mistake.meant)}
    return [mistake for mistake in found if _first(mistake.key) not in named]


def _first(key: str) -> str:
    return re.split(r"[.\[]", key)[0]


DISTANCES = {"run": "d0: 0.1", "curve": "d: {start: 0.02, stop: 0.8, num: 9}", "critical": "d: [0.02, 0.8]"}
"""How each command has the distances, as an example."""


def file_of_another_command(data: Mapping[str, Any], command: str, in_grid: bool = False) -> Mistake | None:
    """A mistake if the keys of a file, or of a case of a grid, fit another command better, else None."""
    unknown = {name: [key for key in data if key not in model_of(name).model_fields] for name in FILES}
    least = min(map(len, unknown.values()))
    if len(unknown[command]) == least:
        return None
    fitting = [name for name, keys in unknown.items() if len(keys) == least]
    foreign = [key for key in unknown[command] if all(key not in unknown[name] for name in fitting)]
    others = " or ".join(f"`pairsim {name}`" for name in fitting)
    one = f"this is one for {others} (it has {', '.join(foreign)})"
    grid = f"; in a grid add command: {' or '.join(fitting)}" if in_grid else ""
    instead = f"; in its place {DISTANCES[command]}" if {"d", "d0"} & {*foreign} and command in DISTANCES else ""
    return Mistake("", None, f"must be a file for `pairsim {command}`, but {one}{instead}{grid}")


def parse_file[T: BaseModel](
    command: str, model: type[T], check: Callable[[T], Iterator[Mistake]], data: Mapping[str, Any], source: str
) -> T:
    """Validate the keys of a sweep or study file, each on its own and against each other, but not its cases.

    Args:
        command: sweep or study.
        model: The model of its file.
        check: Checks of the keys against each other.
        data: Keys and values.
        source: Name of the file in messages.

    Raises:
        InputError: The file has mistakes, or is for another command.
    """
    file, wrong = _validated(model, data)
    if wrong and (other := file_of_another_command(data, command)) is not None:
        raise input_error([other], data, source)
    wrong += _others(check(file), wrong) if file is not None else []
    if wrong or file is None:
        raise input_error(wrong, data, source)
    return file

"""Read and validate case files; error messages use the keys of the file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from pairsim.cases.case import SceneCase
from pairsim.cases.checks import missing_numbers
from pairsim.cases.conversion import forget_numbers, in_numbers
from pairsim.cases.estimate import check_size
from pairsim.cases.keys import Part, groups_of, keys_of
from pairsim.cases.messages import mistakes_of
from pairsim.cases.mistakes import Mistake, input_error
from pairsim.cases.physical import BLOCK, EXPERIMENT
from pairsim.cases.yaml_file import apply_settings, read_yaml
from pairsim.computing import QUESTIONS, Question
from pairsim.computing.many_cases import AtlasFile, StudyFile, SweepFile

OF_MANY: dict[str, type[BaseModel]] = {"sweep": SweepFile, "study": StudyFile, "atlas": AtlasFile}
FILES = (*QUESTIONS, *OF_MANY)  # the kinds of files, by the command that reads them


def model_of(command: str) -> type[BaseModel]:
    """The model that defines the file of a command."""
    return OF_MANY[command] if command in OF_MANY else QUESTIONS[command].model


def read_case[C: SceneCase](question: Question[C], path: Path, overrides: tuple[str, ...] = ()) -> C:
    """Read and validate the case file of a question, with settings key=value that replace or add (dotted) keys.

    Raises:
        InputError: The file cannot be read or has mistakes; lists file, line, key, value and what is allowed.
    """
    data = read_yaml(path)
    forget_numbers(data)
    replaced = {setting.partition("=")[0].strip() for setting in overrides}
    for pair in _two_ways(question.model):
        for key, other in (pair, pair[::-1]):
            group, _, last = other.partition(".")
            if key in replaced and isinstance(data.get(group), dict):
                data[group].pop(last, None)
    apply_settings(data, overrides, groups_of(question.model))
    return parse_case(question, data, str(path))


def _two_ways(model: type[SceneCase]) -> list[tuple[str, str]]:
    """The keys in groups that say up to where an answer goes, each with the quantity for it: either one prolongs it."""
    known = keys_of(model)
    keys = [(known[key], f"{BLOCK}.{each.key}") for each in EXPERIMENT for key in each.gives if key in known]
    return [(key.name, quantity) for key, quantity in keys if key.part is Part.REPORT and "." in key.name]


def parse_case[C: SceneCase](question: Question[C], data: Mapping[str, Any], source: str, entry: str = "") -> C:
    """Make numbers of physical units, and validate the keys and values of a case, each alone and against each other.

    Messages name the lines of keys from `read_yaml`, or `source`; in a file of several cases, `entry` is this one.

    Raises:
        InputError: The case has mistakes; lists each wrong key, its value and what is allowed.
    """
    _refuse_file_of_another_command(data, question.name, source, entry)
    numbers = in_numbers(data, question.model.model_fields)
    mistakes = [*numbers.mistakes, *missing_numbers(question.model, numbers.data, numbers.origins)]
    try:
        case = question.model.model_validate(numbers.data)
        if not mistakes:
            mistakes = list(question.check(case)) or list(check_size(case))
    except ValidationError as error:
        wrong = mistakes_of(error, question.model, numbers.data)
        # What a wrong quantity should give is missing, too.
        known = {each.key for each in mistakes} | numbers.origins.keys()
        mistakes += [each for each in wrong if each.value is not None or each.key not in known]
    if mistakes:
        raise input_error(map(numbers.named, mistakes), data, source, entry)
    return case


def parse_file[T: BaseModel](
    command: str, model: type[T], check: Callable[[T], Iterator[Mistake]], data: Mapping[str, Any], source: str
) -> T:
    """Validate the keys of a file of many cases, each on its own and against each other, but not its cases.

    Raises:
        InputError: The file has mistakes, or is for another command.
    """
    _refuse_file_of_another_command(data, command, source)
    try:
        file = model.model_validate(data)
        mistakes = list(check(file))
    except ValidationError as error:
        mistakes = mistakes_of(error, model, data)
    if mistakes:
        raise input_error(mistakes, data, source)
    return file


def commands_for(path: Path, overrides: tuple[str, ...] = ()) -> list[str]:
    """The commands of questions whose case files have most of the keys of a file with settings, as of `read_case`.

    Raises:
        InputError: The file cannot be read.
    """
    data = read_yaml(path)
    apply_settings(data, overrides, {group for name in QUESTIONS for group in groups_of(model_of(name))})
    return fitting(data, QUESTIONS)


def fitting(data: Mapping[str, Any], commands: Iterable[str]) -> list[str]:
    """The commands whose files have most of some keys."""
    unknown = {name: sum(key not in model_of(name).model_fields for key in data) for name in commands}
    return [name for name, count in unknown.items() if count == min(unknown.values())]


def _refuse_file_of_another_command(data: Mapping[str, Any], command: str, source: str, entry: str = "") -> None:
    """Refuse a file, or a case of a grid, whose keys fit another command better, by an InputError."""
    if all(key in model_of(command).model_fields for key in data):
        return
    others = fitting(data, FILES)
    if command in others:
        return
    own = [model_of(name).model_fields for name in (command, *others)]
    foreign = [key for key in data if key not in own[0] and all(key in fields for fields in own[1:])]
    named = " or ".join(f"`pairsim {name}`" for name in others)
    grid = f"; in a grid add command: {' or '.join(others)}" if entry else ""
    allowed = f"must be a file for `pairsim {command}`, but this is one for {named} (it has {', '.join(foreign)}){grid}"
    raise input_error([Mistake("", None, allowed)], data, source, entry)

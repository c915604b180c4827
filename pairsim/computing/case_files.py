"""Read and validate case files; error messages use the keys of the file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from pairsim.cases.case import SceneCase
from pairsim.cases.checks import missing_numbers, mistakes_in
from pairsim.cases.conversion import forget_numbers, in_numbers
from pairsim.cases.estimate import check_size
from pairsim.cases.keys import Part, groups_of, keys_of
from pairsim.cases.messages import mistakes_of
from pairsim.cases.mistakes import Mistake, input_error
from pairsim.cases.physical import BLOCK, EXPERIMENT
from pairsim.cases.yaml_file import Content, apply_settings, read_yaml
from pairsim.computing.question import Question
from pairsim.runtime.errors import InputError


class Files(Mapping[str, type[BaseModel]]):
    """The models of case files by the command that reads them; a question is imported when its model is looked up.

    Args:
        questions: The questions by name.
        others: The models of other files.
    """

    def __init__(
        self, questions: Mapping[str, Question[Any]], others: Mapping[str, type[BaseModel]] | None = None
    ) -> None:
        self._questions, self._others = questions, others or {}

    def __getitem__(self, command: str) -> type[BaseModel]:
        return self._others[command] if command in self._others else self._questions[command].model

    def __contains__(self, command: object) -> bool:
        return command in self._questions or command in self._others

    def __iter__(self) -> Iterator[str]:
        yield from (*self._questions, *self._others)

    def __len__(self) -> int:
        return len(self._questions) + len(self._others)


def read_case[C: SceneCase](
    question: Question[C], path: Path, overrides: tuple[str, ...] = (), files: Files | None = None
) -> C:
    """Read and validate the case file of a question, with settings key=value that replace or add (dotted) keys.

    If the keys do not fit the question, the message names the commands in `files` that they fit.

    Raises:
        InputError: The file cannot be read or has mistakes; lists file, line, key, value and what is allowed.
    """
    return parse_case(question, content_of_file(question.model, path, overrides), str(path), files=files)


def content_of_file(model: type[SceneCase], path: Path, overrides: tuple[str, ...]) -> Content:
    """The keys and values of a case file with settings key=value that replace or add (dotted) keys; not validated.

    Raises:
        InputError: The file cannot be read, or a setting is none.
    """
    data = read_yaml(path)
    forget_numbers(data)
    replaced = {setting.partition("=")[0].strip() for setting in overrides}
    for pair in _two_ways(model):
        for key, other in (pair, pair[::-1]):
            group, _, last = other.partition(".")
            if key in replaced and isinstance(inner := data.get(group), dict):
                inner.pop(last, None)
    apply_settings(data, overrides, groups_of(model))
    return data


def _two_ways(model: type[SceneCase]) -> list[tuple[str, str]]:
    """Pairs of a key such as time.end and the quantity that gives it, physical.end: setting one removes the other."""
    known = keys_of(model)
    keys = [(known[key], f"{BLOCK}.{each.key}") for each in EXPERIMENT for key in each.gives if key in known]
    return [(key.name, quantity) for key, quantity in keys if key.part is Part.REPORT and "." in key.name]


def parse_case[C: SceneCase](
    question: Question[C], data: Content, source: str, entry: str = "", files: Files | None = None
) -> C:
    """Convert quantities to dimensionless numbers, and validate keys and values of a case, each alone and together.

    Messages name the lines of keys from `read_yaml`, or `source`, and `entry`, which is this case in a file of several.
    If the keys do not fit the question, they name the commands in `files` that they fit.

    Raises:
        InputError: The case has mistakes; lists each wrong key, its value and what is allowed.
    """
    if files is not None:
        refuse_file_of_another_command(data, question.name, files, source, entry)
    data, unread = question.model.with_files(data)
    if unread is not None:
        raise input_error([unread], data, source, entry)
    numbers = in_numbers(data, question.model)
    mistakes = [*numbers.mistakes, *missing_numbers(question.model, numbers.data, numbers.origins)]
    try:
        case = question.model.model_validate(numbers.data)
        if not mistakes:
            mistakes = mistakes_in(case, question.check) or list(check_size(case))
    except ValidationError as error:
        wrong = mistakes_of(error, question.model, numbers.data)
        # A number that a wrong quantity should have given is missing as well, which is not reported a second time.
        known = {each.key for each in mistakes} | numbers.origins.keys()
        mistakes += [each for each in wrong if each.value is not None or each.key not in known]
    if mistakes:
        raise input_error(map(numbers.named, mistakes), data, source, entry)
    return case


def commands_for(path: Path, files: Files, overrides: tuple[str, ...] = ()) -> list[str]:
    """The commands whose case files have most of the keys of a file, with settings as in `read_case`.

    Raises:
        InputError: The file cannot be read.
    """
    data = read_yaml(path)
    apply_settings(data, overrides, {group for model in files.values() for group in groups_of(model)})
    return fitting(data, files)


def fitting(data: Content, files: Files) -> list[str]:
    """The commands in whose case files the fewest of these keys are unknown."""
    unknown = {name: sum(key not in model.model_fields for key in data) for name, model in files.items()}
    return [name for name, count in unknown.items() if count == min(unknown.values())]


def first_accepted[C: SceneCase](commands: Sequence[str], read: Callable[[str], C]) -> tuple[str, C]:
    """The first command that allows the values of a case, whose keys fit all of these commands, and the valid case.

    A file with `along`, for example, has only keys of `critical`, which needs a pair, and of `focus`, which does not.

    Args:
        commands: The commands.
        read: Reads and validates the case for one of them.

    Raises:
        InputError: None of them allows its values; it is the error of the first command.
    """
    failures = list[InputError]()
    for command in commands:
        try:
            return command, read(command)
        except InputError as error:
            failures.append(error)
    raise failures[0]


def refuse_file_of_another_command(data: Content, command: str, files: Files, source: str, entry: str = "") -> None:
    """Refuse a file, or a case of a grid, whose keys fit another command better, by an InputError."""
    if all(key in files[command].model_fields for key in data):
        return
    others = fitting(data, files)
    if command in others:
        return
    own = [files[name].model_fields for name in (command, *others)]
    foreign = [key for key in data if key not in own[0] and all(key in fields for fields in own[1:])]
    named = " or ".join(f"`pairsim {name}`" for name in others)
    grid = f"; in a grid, add command: {' or '.join(others)}" if entry else ""
    allowed = f"must be a file for `pairsim {command}`, but this is one for {named} (it has {', '.join(foreign)}){grid}"
    raise input_error([Mistake("", None, allowed)], data, source, entry)

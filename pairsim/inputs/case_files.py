"""Read and validate case files; error messages use the keys of the file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from pairsim.commands import COMMANDS, Command
from pairsim.config.case import SceneCase
from pairsim.config.cost import check_size
from pairsim.config.mistakes import Mistake, input_error, without
from pairsim.config.physical import BLOCK, Translation, forget_numbers, tuples
from pairsim.config.wording import groups_of, mistakes_of
from pairsim.config.yaml_file import Section, apply_settings, read_yaml
from pairsim.inputs.many_cases import StudyFile, SweepFile
from pairsim.runtime.errors import InputError

FILES: dict[str, type[BaseModel]] = {
    **{name: command.model for name, command in COMMANDS.items()},
    "sweep": SweepFile,
    "study": StudyFile,
}
"""The model that defines each kind of file, by the command that reads it."""


def read_case[C: SceneCase](command: Command[C], path: Path, overrides: tuple[str, ...] = ()) -> C:
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


def parse_case[C: SceneCase](command: Command[C], data: Mapping[str, Any], source: str, entry: str = "") -> C:
    """Validate the keys and values of a case: physical units, each key on its own, then the keys against each other.

    Args:
        command: The command that the case is for.
        data: Keys and values; those from `read_yaml` carry the line numbers for error messages.
        source: Name of the file in error messages.
        entry: Name of the case within a file of several cases, else empty.

    Raises:
        InputError: The case has mistakes; lists each wrong key, its value and what is allowed.
    """
    model, where = command.model, (source, entry)
    translation = Translation(tuples(data), model.model_fields)
    mistakes = list(translation.mistakes)
    try:
        case = model.model_validate(translation.data)
    except ValidationError as error:
        if (other := file_of_another_command(data, command.name)) is not None:
            raise input_error([other], data, *where) from None
        mistakes += mistakes_of(error, groups_of(model), translation.data)
        if any(mistake.key.startswith((f"{BLOCK}.", "liquid")) for mistake in mistakes):  # which may need no De
            mistakes = [mistake for mistake in mistakes if mistake.key != "De" or not mistake.is_missing]
        else:
            mistakes += _further_mistakes(command, translation.data, mistakes)
    else:
        mistakes = mistakes or list(command.check(case)) or list(check_size(case))
    if translation.mistakes:  # nothing was filled in
        mistakes = [each for each in mistakes if not (each.is_missing and each.key in translation.given)]
    mistakes = list({(each.key, each.is_missing): each for each in reversed(mistakes)}.values())[::-1]
    if mistakes:
        raise input_error([translation.at_origin(mistake) for mistake in mistakes], data, *where) from None
    return case


def _further_mistakes(command: Command[Any], data: Mapping[str, Any], found: Sequence[Mistake]) -> list[Mistake]:
    """Mistakes in the rest of a case after its wrong keys have been removed.

    If values are wrong, checks that combine keys are unreliable, so only missing keys are reported.
    """
    try:
        case = command.model.model_validate({"De": 0, **without(data, found)})
    except ValidationError:
        return []
    named = {key for mistake in found for key in (mistake.key.partition("[")[0], mistake.meant)}
    whole = all(mistake.is_unknown for mistake in found)
    return [mistake for mistake in command.check(case) if (whole or mistake.is_missing) and mistake.key not in named]


def file_of_another_command(data: Mapping[str, Any], command: str) -> Mistake | None:
    """A mistake if the keys of a file fit another command better, else None."""
    unknown = {name: [key for key in data if key not in model.model_fields] for name, model in FILES.items()}
    least = min(map(len, unknown.values()))
    if len(unknown[command]) == least:
        return None
    fitting = [name for name, keys in unknown.items() if len(keys) == least]
    foreign = [key for key in unknown[command] if all(key not in unknown[name] for name in fitting)]
    others = " or ".join(f"`pairsim {name}`" for name in fitting)
    return Mistake(
        "", None, f"must be a file for `pairsim {command}`, but this is one for {others} (it has {', '.join(foreign)})"
    )


def wrong_keys(command: Command[Any], data: Mapping[str, Any], source: str, entry: str) -> InputError | None:
    """The keys of a case that are wrong on their own, if any; missing keys and those that do not go together are not.

    For the cases of a file whose other mistakes may have left out some of their keys.
    """
    model = command.model
    translation = Translation(tuples(data), model.model_fields)
    try:
        model.model_validate(translation.data)
    except ValidationError as error:
        found = [m for m in mistakes_of(error, groups_of(model), translation.data) if not m.is_missing]
        return input_error([translation.at_origin(m) for m in found], data, source, entry) if found else None
    return None


def check_file[T: BaseModel](
    command: str, model: type[T], check: Callable[[T], Iterator[Mistake]], data: Mapping[str, Any], source: str
) -> tuple[T | None, list[Mistake]]:
    """Validate the keys of a sweep or study file, each on its own and against each other, but not its cases.

    Args:
        command: sweep or study.
        model: The model of its file.
        check: Checks of the keys against each other.
        data: Keys and values.
        source: Name of the file in messages.

    Returns:
        The file without its wrong keys, None if too little of it is left, and the mistakes.

    Raises:
        InputError: The file is for another command.
    """
    try:
        file = model.model_validate(data)
    except ValidationError as error:
        if (other := file_of_another_command(data, command)) is not None:
            raise input_error([other], data, source) from None
        mistakes = mistakes_of(error, groups_of(model), data)
    else:
        return file, list(check(file))
    try:
        file = model.model_validate(without(data, mistakes))
    except ValidationError:
        return None, mistakes
    named = {re.split(r"[.\[]", key)[0] for mistake in mistakes for key in (mistake.key, mistake.meant)}
    return file, mistakes + [m for m in check(file) if re.split(r"[.\[]", m.key)[0] not in named]

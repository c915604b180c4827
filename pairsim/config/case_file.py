"""Read and validate case files; error messages use the keys of the file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from pairsim.config.case import Case, SceneCase
from pairsim.config.case_checks import check_together
from pairsim.config.cost import check_size
from pairsim.config.curve_case import CriticalCase, CurveCase, check_critical, check_curve
from pairsim.config.many_cases import StudyFile, SweepFile
from pairsim.config.mistakes import Mistake, input_error, without
from pairsim.config.physical import BLOCK, Translation, forget_numbers, tuples
from pairsim.config.wording import groups_of, mistakes_of
from pairsim.config.yaml_file import Section, apply_settings, read_yaml
from pairsim.runtime.errors import InputError

MODELS: dict[str, type[SceneCase]] = {"run": Case, "curve": CurveCase, "critical": CriticalCase}
"""The model that defines the case file of each command."""
FILES: dict[str, type[BaseModel]] = {**MODELS, "sweep": SweepFile, "study": StudyFile}
"""The model that defines each kind of file, by the command that reads it."""


def load_case(path: Path, overrides: tuple[str, ...] = ()) -> Case:
    """Read and validate the case file of a run.

    Args:
        path: The file.
        overrides: key=value settings (dotted keys) that replace or add keys of the file.

    Raises:
        InputError: The file cannot be read or has mistakes; lists file, line, key, value and what is allowed.
    """
    return case_from_dict(read_with(path, overrides), str(path))


def load_curve(path: Path, overrides: tuple[str, ...] = ()) -> CurveCase:
    """Read and validate the case file of a master curve; arguments and errors as for `load_case`."""
    return curve_from_dict(read_with(path, overrides), str(path))


def load_critical(path: Path, overrides: tuple[str, ...] = ()) -> CriticalCase:
    """Read and validate the case file of critical distances; arguments and errors as for `load_case`."""
    return critical_from_dict(read_with(path, overrides), str(path))


def read_with(path: Path, overrides: tuple[str, ...]) -> Section:
    """Read a case file and apply key=value settings, without validating the case.

    Raises:
        InputError: The file cannot be read, or a setting is not of the form key=value.
    """
    data = read_yaml(path)
    forget_numbers(data)
    apply_settings(data, overrides)
    return data


def case_from_dict(data: Mapping[str, Any], source: str, entry: str = "") -> Case:
    """Validate the keys and values of a run.

    Args:
        data: Keys and values; those from `read_yaml` carry the line numbers for error messages.
        source: Name of the file in error messages.
        entry: Name of the case within a file of several cases, else empty.

    Raises:
        InputError: The case has mistakes; lists each wrong key, its value and what is allowed.
    """
    return _checked("run", Case, check_together, data, (source, entry))


def curve_from_dict(data: Mapping[str, Any], source: str, entry: str = "") -> CurveCase:
    """Validate the keys and values of a master curve; arguments and errors as for `case_from_dict`."""
    return _checked("curve", CurveCase, check_curve, data, (source, entry))


def critical_from_dict(data: Mapping[str, Any], source: str, entry: str = "") -> CriticalCase:
    """Validate the keys and values of critical distances; arguments and errors as for `case_from_dict`."""
    return _checked("critical", CriticalCase, check_critical, data, (source, entry))


def _checked[T: SceneCase](
    command: str,
    model: type[T],
    check: Callable[[T], Iterator[Mistake]],
    data: Mapping[str, Any],
    where: tuple[str, str],
) -> T:
    """Convert physical units, validate each key on its own, then check the keys against each other."""
    translation = Translation(tuples(data), model.model_fields)
    mistakes = list(translation.mistakes)
    try:
        case = model.model_validate(translation.data)
    except ValidationError as error:
        if (other := file_of_another_command(data, command)) is not None:
            raise input_error([other], data, *where) from None
        mistakes += mistakes_of(error, groups_of(model), translation.data)
        if any(mistake.key.startswith((f"{BLOCK}.", "liquid")) for mistake in mistakes):  # which may need no De
            mistakes = [mistake for mistake in mistakes if mistake.key != "De" or not mistake.is_missing]
        else:
            mistakes += _further_mistakes(model, check, translation.data, mistakes)
    else:
        mistakes = mistakes or list(check(case)) or list(check_size(case))
    if translation.mistakes:  # nothing was filled in
        mistakes = [each for each in mistakes if not (each.is_missing and each.key in translation.given)]
    mistakes = list({(each.key, each.is_missing): each for each in reversed(mistakes)}.values())[::-1]
    if mistakes:
        raise input_error([translation.at_origin(mistake) for mistake in mistakes], data, *where) from None
    return case


def _further_mistakes[T: SceneCase](
    model: type[T], check: Callable[[T], Iterator[Mistake]], data: Mapping[str, Any], found: Sequence[Mistake]
) -> list[Mistake]:
    """Mistakes in the rest of a case after its wrong keys have been removed.

    If values are wrong, checks that combine keys are unreliable, so only missing keys are reported.
    """
    try:
        case = model.model_validate({"De": 0, **without(data, found)})
    except ValidationError:
        return []
    named = {key for mistake in found for key in (mistake.key.partition("[")[0], mistake.meant)}
    whole = all(mistake.is_unknown for mistake in found)
    return [mistake for mistake in check(case) if (whole or mistake.is_missing) and mistake.key not in named]


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


def wrong_keys(data: Mapping[str, Any], command: str, source: str, entry: str) -> InputError | None:
    """The keys of a case that are wrong on their own, if any; missing keys and those that do not go together are not.

    For the cases of a file whose other mistakes may have left out some of their keys.
    """
    model = MODELS[command]
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


PARSERS: dict[str, Callable[[Mapping[str, Any], str], SceneCase]] = {
    "run": case_from_dict,
    "curve": curve_from_dict,
    "critical": critical_from_dict,
}
"""The function that validates the keys and values of a case of each command."""
LOADERS: dict[str, Callable[[Path, tuple[str, ...]], SceneCase]] = {
    "run": load_case,
    "curve": load_curve,
    "critical": load_critical,
}
"""The function that reads and validates the case file of each command."""

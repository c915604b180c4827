"""Case files: YAML in, a checked case out, and errors in the words of the file."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from pairsim.config.case import Case, SceneCase
from pairsim.config.case_checks import check_together
from pairsim.config.cost import check_size
from pairsim.config.curve_case import CriticalCase, CurveCase, check_critical, check_curve
from pairsim.config.many_cases import StudyFile, SweepFile
from pairsim.config.mistakes import Mistake, input_error
from pairsim.config.physical import BLOCK, Translation, forget_numbers, tuples
from pairsim.config.wording import groups_of, mistakes_of, unknown_key
from pairsim.config.yaml_file import Section, apply_settings, read_yaml

MODELS: dict[str, type[SceneCase]] = {"run": Case, "curve": CurveCase, "critical": CriticalCase}
"""What the case file of each command is checked against."""
FILES: dict[str, type[BaseModel]] = {**MODELS, "sweep": SweepFile, "study": StudyFile}
"""The keys of every kind of file, by the command that reads it."""


def load_case(path: Path, overrides: tuple[str, ...] = ()) -> Case:
    """Read and check the file of a case in time.

    Args:
        path: The file.
        overrides: key=value settings (dotted keys) that replace or add to what the file says.

    Raises:
        InputError: With file, line, key, value and what must be, of every mistake.
    """
    return case_from_dict(read_with(path, overrides), str(path))


def load_curve(path: Path, overrides: tuple[str, ...] = ()) -> CurveCase:
    """Read and check the file of a master curve; as `load_case`."""
    return curve_from_dict(read_with(path, overrides), str(path))


def load_critical(path: Path, overrides: tuple[str, ...] = ()) -> CriticalCase:
    """Read and check the file of a search for critical distances; as `load_case`."""
    return critical_from_dict(read_with(path, overrides), str(path))


def read_with(path: Path, overrides: tuple[str, ...]) -> Section:
    """A case file's content with key=value settings put in.

    Raises:
        InputError: The file cannot be read or a setting is not understood.
    """
    data = read_yaml(path)
    forget_numbers(data)
    apply_settings(data, overrides)
    return data


def case_from_dict(data: Mapping[str, Any], source: str, entry: str = "") -> Case:
    """Check plain data.

    Args:
        data: Keys and values; those of `read_yaml` know their lines.
        source: What messages name as the file.
        entry: The case among those of the file, empty if it holds one.

    Raises:
        InputError: With every wrong key, its value and what must be.
    """
    return _checked("run", Case, check_together, data, (source, entry))


def curve_from_dict(data: Mapping[str, Any], source: str, entry: str = "") -> CurveCase:
    """Check plain data; as `case_from_dict`."""
    return _checked("curve", CurveCase, check_curve, data, (source, entry))


def critical_from_dict(data: Mapping[str, Any], source: str, entry: str = "") -> CriticalCase:
    """Check plain data; as `case_from_dict`."""
    return _checked("critical", CriticalCase, check_critical, data, (source, entry))


def _checked[T: SceneCase](
    command: str,
    model: type[T],
    check: Callable[[T], Iterator[Mistake]],
    data: Mapping[str, Any],
    where: tuple[str, str],
) -> T:
    """The case, its units turned into numbers, each key checked alone and then with the others."""
    translation = Translation(tuples(data), model.model_fields)
    mistakes = list(translation.mistakes)
    try:
        case = model.model_validate(translation.data)
    except ValidationError as error:
        if (other := file_of_another_command(data, command)) is not None:
            raise input_error([other], data, *where) from None
        mistakes += mistakes_of(error, groups_of(model))
        if any(mistake.key.startswith(f"{BLOCK}.") for mistake in mistakes):
            mistakes = [mistake for mistake in mistakes if mistake.key != "De" or not mistake.is_missing]
        else:
            mistakes += _besides(model, check, translation.data, mistakes)
    else:
        mistakes = mistakes or list(check(case)) or list(check_size(case))
    if mistakes:
        raise input_error([translation.told(mistake) for mistake in mistakes], data, *where) from None
    return case


def _besides[T: SceneCase](
    model: type[T], check: Callable[[T], Iterator[Mistake]], data: Mapping[str, Any], found: Sequence[Mistake]
) -> list[Mistake]:
    """Further mistakes of a case with wrong keys, asked of what is left without them.

    Where values are wrong, what goes together is unknown: only keys that are missing are told.
    """
    rest = copy.deepcopy(dict(data))
    for mistake in found:
        *groups, last = mistake.key.partition("[")[0].split(".")
        inner = rest
        for group in groups if mistake.key not in rest else ():
            inner = inner[group]
        inner.pop(last if inner is not rest else mistake.key.partition("[")[0], None)
    try:
        case = model.model_validate({"De": 0, **rest})
    except ValidationError:
        return []
    named = {key for mistake in found for key in (mistake.key.partition("[")[0], mistake.meant)}
    whole = all(mistake.is_unknown for mistake in found)
    return [mistake for mistake in check(case) if (whole or mistake.is_missing) and mistake.key not in named]


def file_of_another_command(data: Mapping[str, Any], command: str) -> Mistake | None:
    """That a file was written for another command, judged by its keys; None if it was not."""
    unknown = {name: [key for key in data if key not in model.model_fields] for name, model in FILES.items()}
    least = min(map(len, unknown.values()))
    if len(unknown[command]) == least:
        return None
    fitting = [name for name, keys in unknown.items() if len(keys) == least]
    telling = [key for key in unknown[command] if all(key not in unknown[name] for name in fitting)]
    others = " or ".join(f"`pairsim {name}`" for name in fitting)
    return Mistake("", None, f"this is a case for {others} (it has {', '.join(telling)}), not for `pairsim {command}`")


def check_keys(data: Mapping[str, Any], command: str, source: str) -> None:
    """The keys of a sweep or study file.

    Raises:
        InputError: With every unknown one, or that the file is one for another command.
    """
    model = FILES[command]
    wrong = [unknown_key(key, value, {"": model}) for key, value in data.items() if key not in model.model_fields]
    if wrong:
        other = file_of_another_command(data, command)
        raise input_error([other] if other is not None else wrong, data, source)


LOADERS: dict[str, Callable[[Path, tuple[str, ...]], SceneCase]] = {
    "run": load_case,
    "curve": load_curve,
    "critical": load_critical,
}
"""How the case file of each command is read."""

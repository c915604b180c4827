"""Cases of a file of many: files that it names, and changes merged into a base case."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from pairsim.cases.merging import merge
from pairsim.cases.mistakes import Mistake, input_error
from pairsim.cases.yaml_file import Section, place_of, read_yaml
from pairsim.runtime.errors import InputError


def file_named(path: Path, name: str, key: str, data: Mapping[str, Any]) -> Section:
    """The content of a case file that a key of a grid file names.

    Raises:
        InputError: It cannot be read.
    """
    named = path.parent / name
    try:
        return read_yaml(named)
    except InputError as error:
        if error.line is not None or error.file != str(named):
            raise
        raise input_error([Mistake(key, name, error.allowed)], data, str(path)) from None


def merged_into(target: Section, changes: Mapping[str, Any], where: tuple[str, str, Mapping[str, Any]]) -> Section:
    """Merge changes into a case, in place.

    Args:
        target: The case.
        changes: Keys and values, dotted or nested.
        where: For messages: the file, the name of the entry in it, and its content.

    Raises:
        InputError: A dotted key goes through a value that is no group.
    """
    source, entry, data = where

    def refuse(key: str, value: Any, allowed: str) -> NoReturn:
        place = place_of(changes, key) or place_of(data, entry)
        file, line = (source, None) if place is None else place
        raise InputError(file, key, value, allowed, line=line, entry=entry)

    merge(target, changes, refuse)
    return target


def value_at(data: Mapping[str, Any], dotted: str, default: Any = None) -> Any:
    """Value of a dotted key in nested data."""
    value: Any = data
    for part in dotted.split("."):
        if not isinstance(value, Mapping) or part not in value:
            return default
        value = value[part]
    return value

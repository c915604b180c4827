"""What grid files and study files share: a base case, changes to it, and mistakes that are reported all at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from pairsim.config.merging import merge
from pairsim.config.mistakes import Mistake, Mistakes, input_error
from pairsim.config.physical import forget_numbers
from pairsim.config.yaml_file import Section, place_of, places_in, read_yaml
from pairsim.inputs.case_files import check_file
from pairsim.inputs.many_cases import StudyFile, SweepFile
from pairsim.runtime.errors import InputError


class Reader[File: SweepFile | StudyFile]:
    """Reads the content of a file; its mistakes are collected.

    Args:
        model: The model of its keys.
        check: Checks of the keys against each other.
        path: The file, to whose folder relative paths in the content refer.
        data: The content.
        settings: key=value settings that replace keys in every case.
        mistakes: Those found so far.

    Attributes:
        file: The content without its wrong keys; None if too little of it is left.
        name: Name of the sweep or study.
        base: The base case.
    """

    def __init__(
        self,
        model: type[File],
        check: Callable[[File], Iterator[Mistake]],
        path: Path,
        data: dict[str, Any],
        settings: tuple[str, ...],
        mistakes: Mistakes,
    ) -> None:
        self.path, self.data, self.settings, self.mistakes = path, data, settings, mistakes
        self.file, wrong = check_file("sweep" if model is SweepFile else "study", model, check, data, str(path))
        self.refuse(*wrong)
        self.name = (self.file and self.file.name) or path.stem
        self.base = Section()
        with self.collected():
            if self.file is not None and "base" in self.file.model_fields_set:
                base = data.get("base", {})
                base = file_named(path, base, "base", data) if isinstance(base, str) else base
                forget_numbers(base)
                merged_into(self.base, base, (str(path), "base", data))

    def refuse(self, *mistakes: Mistake) -> None:
        """Collect mistakes in the content."""
        if mistakes:
            self.mistakes.add(input_error(mistakes, self.data, str(self.path)))

    @contextmanager
    def collected(self) -> Iterator[None]:
        """Context whose InputError is one of the mistakes of the file."""
        try:
            yield
        except InputError as error:
            self.mistakes.add(error)


def file_named(path: Path, name: str, key: str, data: Mapping[str, Any]) -> Section:
    """The content of a case file that a key of a grid file names.

    Raises:
        InputError: It cannot be read, or is not in the folder of the grid file or below it.
    """
    named = path.parent / name
    leaves = Path(name).is_absolute() or ".." in Path(name).parts
    if leaves and places_in(data):  # the content of a file, perhaps someone else's; a Python program may name any file
        inside = "must be a file in the folder of this file or in a folder below it"
        raise input_error([Mistake(key, name, inside)], data, str(path))
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

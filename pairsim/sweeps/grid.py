"""Grid files: a base case and the keys to vary. All cases are validated before the first one is computed."""

from __future__ import annotations

import copy
import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, NoReturn

from pairsim.commands import COMMANDS, Command
from pairsim.config.merging import merge
from pairsim.config.mistakes import Mistake, Mistakes, input_error
from pairsim.config.physical import BLOCK, forget_numbers
from pairsim.config.values import FOLDER_WORDS, is_finite, is_name
from pairsim.config.yaml_file import Section, apply_settings, place_of, places_in, read_yaml
from pairsim.inputs.case_files import check_file, wrong_keys
from pairsim.inputs.many_cases import SweepFile, check_sweep
from pairsim.runtime.errors import InputError
from pairsim.runtime.names import fits_a_folder
from pairsim.sweeps.case import SweepCase

NUMBERS = ("beta", "De", "Ca_e", "xi", "d0")  # keys whose values a physical block can give


@dataclass(frozen=True)
class Grid:
    """A validated grid file.

    Attributes:
        source: The file.
        name: Name of the sweep.
        command: The command that computes each case.
        cases: The cases without duplicates, in the order of the file.
        varying: Dotted keys that take more than one value, in the order of the file.
        key: Hash of the set of cases.
        duplicates: Number of duplicates left out.
        excluded: Number of entries excluded.
        content: Content of the file, with the base case included.
    """

    source: Path
    name: str
    command: Command[Any]
    cases: tuple[SweepCase, ...]
    varying: tuple[str, ...]
    key: str
    duplicates: int
    excluded: int
    content: dict[str, Any]

    def part(self, kept: Sequence[int]) -> Grid:
        """A grid with some of the cases, by index; all cases must be entries of `cases` in the file."""
        entries = self.content["cases"]
        content = {**self.content, "cases": [entries[i] for i in kept]}
        cases = tuple(self.cases[i] for i in kept)
        return replace(self, cases=cases, key=_whole_key(case.key for case in cases), content=content)

    @property
    def columns(self) -> tuple[str, ...]:
        """Result columns of all cases, in the order of their first appearance."""
        own = (name for case in self.cases for name in case.columns)
        return tuple(dict.fromkeys((*own, *self.command.in_sweeps.last)))


def read_grid(path: Path, settings: tuple[str, ...] = ()) -> Grid:
    """Read a grid file and validate every case.

    Args:
        path: The file.
        settings: key=value settings that replace keys in every case.

    Raises:
        InputError: The file or a case has mistakes; lists file, entry, key, value and what is allowed.
    """
    return grid_from(path, read_yaml(path), settings)


def grid_from(
    path: Path, data: dict[str, Any], settings: tuple[str, ...] = (), names: Sequence[str] | None = None
) -> Grid:
    """As `read_grid`, from the content of a grid file.

    Args:
        path: The file, to whose folder relative paths in the content refer.
        data: The content.
        settings: key=value settings that replace keys in every case.
        names: Names of the entries of `cases` in messages.
    """
    return _Reader(path, data, settings, names).grid()


def check_keys(path: Path, data: dict[str, Any], settings: tuple[str, ...], names: Sequence[str]) -> None:
    """Find mistakes in single keys of the cases, for a file that has other mistakes; arguments as for `grid_from`.

    Raises:
        InputError: There are some.
    """
    reader = _Reader(path, data, settings, names)
    list(reader.checked(partly=True))
    if reader.mistakes:
        raise reader.mistakes.error(reader.count)


def read_base(path: Path, data: Mapping[str, Any]) -> Section:
    """The base case in the content of a grid file, with dotted keys nested.

    Raises:
        InputError: The file of the base cannot be read, or a dotted key goes through a value that is no group.
    """
    base = data.get("base", {})
    if isinstance(base, str):
        base = _file(path, base, "base", data)
    forget_numbers(base)
    return _merged(Section(), base, (str(path), "base", data))


def _file(path: Path, name: str, key: str, data: Mapping[str, Any]) -> Section:
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


def _merged(target: Section, changes: Mapping[str, Any], where: tuple[str, str, Mapping[str, Any]]) -> Section:
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


class _Reader:
    """Reads the content of a grid file; its mistakes are collected, so that all of them are reported at once."""

    def __init__(
        self, path: Path, data: dict[str, Any], settings: tuple[str, ...], names: Sequence[str] | None
    ) -> None:
        self.path, self.data, self.settings, self.names = path, data, settings, names
        self.mistakes = Mistakes()
        self.count = self.excluded = 0
        file, wrong = check_file("sweep", SweepFile, check_sweep, data, str(path))
        if wrong:
            self.mistakes.add(input_error(wrong, data, str(path)))
        self.file = file or SweepFile()
        self.name = self.file.name or path.stem
        if not fits_a_folder(self.name):
            self._refuse("name", self.name, f"is the name of the file; name must be given, as {FOLDER_WORDS}")
        self.command = COMMANDS[self.file.command]
        self.base = Section()
        if file is not None and "base" in file.model_fields_set:
            with self._collected():
                self.base = read_base(path, data)

    def _refuse(self, key: str, value: Any, allowed: str) -> None:
        self.mistakes.add(input_error([Mistake(key, value, allowed)], self.data, str(self.path)))

    @contextmanager
    def _collected(self) -> Iterator[None]:
        """Context whose InputError is one of the mistakes of the file."""
        try:
            yield
        except InputError as error:
            self.mistakes.add(error)

    def _axes(self) -> Iterator[list[Section]]:
        """Yield the factors of the product of all combinations: for each, the list of its changes."""
        for key, values in self.file.grid.items():
            yield [Section({key: value}, places_in(self.data["grid"])) for value in values]
        given = self.data["zip"] if isinstance(self.data.get("zip"), list) else [self.data.get("zip")]
        for columns, source in zip(self.file.zip, given, strict=False):
            rows = zip(*columns.values(), strict=False)
            yield [Section(dict(zip(columns, row, strict=True)), places_in(source)) for row in rows]

    def _entries(self) -> Iterator[tuple[str, Section, bool]]:
        """Yield for each entry: its name in messages, its changes, and whether `exclude` applies."""
        axes = list(self._axes())
        for row in product(*axes) if axes else ():
            changes = Section()
            for part in row:
                changes.update(part)
                changes.places.update(part.places)
            yield "entry " + ", ".join(f"{key} = {value}" for key, value in changes.items()), changes, True
        cases = self.data.get("cases")
        for i, entry in enumerate(cases if isinstance(cases, list | tuple) else ()):
            where = self.names[i] if self.names is not None else f"cases[{i}]"
            if isinstance(entry, str):
                with self._collected():
                    content = _file(self.path, entry, where, self.data)
                    named = {"name": Path(entry).stem} if is_name(Path(entry).stem) else {}
                    yield where, Section({**named, **content}, content.places), False
            elif isinstance(entry, dict):
                yield where, Section(entry, places_in(entry)), False

    def checked(self, partly: bool) -> Iterator[tuple[Iterable[str], Section, SweepCase]]:
        """Check every entry that is not excluded; yields changed keys, merged keys and case of those without mistakes.

        Args:
            partly: Whether to check single keys only, of all entries, and to yield nothing.
        """
        used = set()
        for where, changes, optional in self._entries():
            with self._collected():
                merged = _merged(copy.deepcopy(self.base), changes, (str(self.path), where, self.data))
                apply_settings(merged, self.settings)
                hits = {i for i, each in enumerate(self.file.exclude) if optional and _matches(merged, each)}
                if hits and not partly:
                    used |= hits
                    self.excluded += 1
                    continue
                self.count += 1
                if not partly:
                    case = SweepCase.of(self.command, merged, str(self.path), where)
                    yield changes if optional else flat(changes), merged, case
                elif (error := wrong_keys(self.command, merged, str(self.path), where)) is not None:
                    raise error
        for i in () if partly else sorted(set(range(len(self.file.exclude))) - used):
            self._refuse(f"exclude[{i}]", self.file.exclude[i], "must match at least one entry of the grid")

    def grid(self) -> Grid:
        """Merge the keys of every entry, apply exclusions, validate, and remove duplicates."""
        found: dict[str, tuple[SweepCase, Section]] = {}
        varied: dict[str, None] = {}
        entries = 0
        for keys, merged, case in self.checked(partly=bool(self.mistakes)):
            varied |= dict.fromkeys(keys)
            found.setdefault(case.key, (case, merged))
            entries += 1
        if not found and not self.mistakes:
            self._refuse("exclude", None, "must leave at least one case")
        if self.mistakes:
            raise self.mistakes.error(self.count)
        if any(key.startswith(BLOCK) for key in varied):  # the numbers computed from it vary, too
            varied |= dict.fromkeys(NUMBERS)
            if any(value_at(merged, f"{BLOCK}.end") is not None for _, merged in found.values()):
                varied["time.end"] = None
        values = [
            {key: value_at(case.resolved, key, value_at(merged, key)) for key in varied}
            for case, merged in found.values()
        ]
        varying = tuple(key for key in varied if any(each[key] != values[0][key] for each in values))
        cases = tuple(
            replace(case, parameters={key: each[key] for key in varying})
            for (case, _), each in zip(found.values(), values, strict=True)
        )
        whole, duplicates, content = _whole_key(found), entries - len(found), {**self.data, "base": self.base}
        return Grid(self.path, self.name, self.command, cases, varying, whole, duplicates, self.excluded, content)


def _whole_key(keys: Iterable[str]) -> str:
    """Hash of a set of cases."""
    return hashlib.sha256("\n".join(sorted(keys)).encode()).hexdigest()


def _matches(merged: Mapping[str, Any], entry: Mapping[str, Any]) -> bool:
    """Whether a case matches an exclusion in every key: equal, or between min and max."""

    def fits(value: Any, wanted: Any) -> bool:
        if isinstance(wanted, dict) and wanted and set(wanted) <= {"min", "max"}:
            return is_finite(value) and wanted.get("min", -math.inf) <= value <= wanted.get("max", math.inf)
        if is_finite(value) and is_finite(wanted):
            return math.isclose(value, wanted, rel_tol=1e-9)
        return bool(value == wanted)

    return all(fits(value_at(merged, key), wanted) for key, wanted in entry.items())


def value_at(data: Mapping[str, Any], dotted: str, default: Any = None) -> Any:
    """Value of a dotted key in nested data."""
    value: Any = data
    for part in dotted.split("."):
        if not isinstance(value, Mapping) or part not in value:
            return default
        value = value[part]
    return value


def flat(entry: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Convert nested keys to dotted keys."""
    spelled: dict[str, Any] = {}
    for key, value in entry.items():
        spelled |= flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return spelled

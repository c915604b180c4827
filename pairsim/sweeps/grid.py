"""Grid files: a base case and the keys to vary. All cases are validated before the first one is computed."""

from __future__ import annotations

import copy
import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, NoReturn

from pairsim.config.case_file import check_keys
from pairsim.config.identity import folder_name, key_of
from pairsim.config.merging import merge
from pairsim.config.physical import BLOCK, forget_numbers
from pairsim.config.quantities import quantity_range
from pairsim.config.ranges import RANGE, spelled_out
from pairsim.config.values import LONGEST_NAME, fits_a_folder, is_finite, is_name
from pairsim.config.yaml_file import Place, Section, apply_settings, place_of, read_yaml
from pairsim.results.folders import read_record
from pairsim.runtime.errors import InputError
from pairsim.sweeps.commands import COMMANDS, Checked, SweepCommand

MOST_CASES = 100_000
MOST_VALUES = 10 * MOST_CASES  # in grid and zip together
NUMBERS = ("beta", "De", "Ca_e", "xi", "d0", "time.end")  # keys whose values a physical block can give


@dataclass(frozen=True)
class SweepCase:
    """One case of a sweep.

    Attributes:
        folder: Name of its folder, `<slug>-<beginning of key>`.
        key: Hash that identifies the case.
        checked: The validated case.
        parameters: Values of the varying keys.
    """

    folder: str
    key: str
    checked: Checked
    parameters: dict[str, Any]


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
    command: SweepCommand[Any]
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
        own = (name for case in self.cases for name in case.checked.columns)
        return tuple(dict.fromkeys((*own, *self.command.last)))


def read_grid(path: Path, settings: tuple[str, ...] = ()) -> Grid:
    """Read a grid file and validate every case.

    Args:
        path: The file.
        settings: key=value settings that replace keys in every case.

    Raises:
        InputError: The file or a case has mistakes; lists file, entry, key, value and what is allowed.
    """
    return grid_from(path, read_yaml(path), settings)


def grid_from(path: Path, data: dict[str, Any], settings: tuple[str, ...] = ()) -> Grid:
    """As `read_grid`, from the content of a grid file; relative paths in it refer to the folder of `path`."""
    return _Reader(path, data).grid(settings)


def read_base(path: Path, data: dict[str, Any]) -> dict[str, Any]:
    """The base case in the content of a grid file, with dotted keys nested.

    Raises:
        InputError: `base` is invalid.
    """
    return _Reader(path, data).base


class _Reader:
    """Reads the content of a grid file."""

    def __init__(self, path: Path, data: dict[str, Any]) -> None:
        self.path, self.data = path, data
        self._count = 0  # values of grid and zip so far
        check_keys(data, "sweep", str(path))
        name = data.get("command", "run")
        if not isinstance(name, str) or name not in COMMANDS:
            self.refuse("command", name, f"must be {' or '.join(COMMANDS)}")
        self.command = COMMANDS[name]
        self.name = data.get("name", path.stem)
        if not isinstance(self.name, str) or not fits_a_folder(self.name) or self.name.startswith("."):
            allowed = f"must be a name for a folder, of at most {LONGEST_NAME} bytes, without /, not beginning with ."
            self.refuse("name", self.name, allowed)
        self.base = self._base()

    def refuse(self, key: str, value: Any, allowed: str) -> NoReturn:
        section, _, name = key.partition(": ")  # keys of grid and zip are given as "section: key"
        inner = self.data.get(section)
        place = place_of(inner, name) if isinstance(inner, Section) else None
        place = place or place_of(self.data, section.split(",")[0])
        raise InputError(str(self.path), key, value, allowed, line=place.line if place else None)

    def _base(self) -> Section:
        base = self.data.get("base", {})
        if isinstance(base, str):
            base = read_yaml(self.path.parent / base)
        if not isinstance(base, dict):
            self.refuse("base", base, "must be keys and values of a case, or the path of a case file")
        forget_numbers(base)
        merged = Section()
        self._merge(merged, base, "base")
        return merged

    def _merge(self, target: Section, changes: Mapping[str, Any], where: str) -> None:
        """Merge changes into a case; `where` names the entry in error messages."""

        def refuse(key: str, value: Any, allowed: str) -> NoReturn:
            self.refuse(f"{where}: {key}", value, allowed)

        merge(target, changes, refuse)

    def _values(self, section: str, key: str, value: Any) -> list[Any]:
        """The values of a key of grid or zip, given as a list or a range."""
        values = self._expanded(f"{section}: {key}", key, value)
        self._count += len(values)
        if self._count > MOST_VALUES:
            self.refuse(f"{section}: {key}", value, f"must give at most {MOST_VALUES} values, with those of other keys")
        return values

    def _expanded(self, where: str, key: str, value: Any) -> list[Any]:
        if isinstance(value, list):
            if not value:
                self.refuse(where, value, "must have at least one value")
            return value
        if not isinstance(value, dict) or not set(value) <= set(RANGE):
            choices = "a list of values or {start, stop, num, spacing: linear or log}"
            self.refuse(where, value, f"must be {choices}; write mesh.Np for a key in a group")
        try:
            if key.startswith(f"{BLOCK}."):
                return list(quantity_range(value, MOST_CASES))
            return list(spelled_out(value, MOST_CASES))
        except ValueError as error:
            self.refuse(where, value, str(error))

    def _axes(self) -> list[list[Section]]:
        """The factors of the product of all combinations: for each, the list of its changes."""
        axes: list[list[Section]] = []
        grid, zips = self.data.get("grid", {}), self.data.get("zip", {})
        if not isinstance(grid, dict):
            self.refuse("grid", grid, "must be keys, each with a list or a range of values")
        axes += [
            [Section({key: value}, _places(grid)) for value in self._values("grid", key, values)]
            for key, values in grid.items()
        ]
        for zipped in zips if isinstance(zips, list) else [zips] if zips else []:
            if not isinstance(zipped, dict) or not zipped:
                self.refuse("zip", zipped, "must be keys with lists of equal length, or a list of such groups")
            columns = {key: self._values("zip", key, values) for key, values in zipped.items()}
            lengths = {key: len(values) for key, values in columns.items()}
            if len(set(lengths.values())) > 1:
                counts = ", ".join(f"{key} has {count}" for key, count in lengths.items())
                self.refuse("zip", None, f"must have the same number of values for all keys; {counts}")
            rows = zip(*columns.values(), strict=True)
            axes.append([Section(dict(zip(columns, row, strict=True)), _places(zipped)) for row in rows])
        seen: set[str] = set()
        for axis in axes:
            if repeated := seen & set(axis[0]):
                self.refuse(sorted(repeated)[0], None, "must occur only once in grid and zip")
            seen |= set(axis[0])
        if math.prod(map(len, axes)) > MOST_CASES:
            self.refuse("grid", None, f"must give at most {MOST_CASES} cases")
        return axes

    def _entries(self) -> Iterator[tuple[str, dict[str, Any], Section, bool]]:
        """Yield for each entry: its name in messages, its changes, the merged case, and whether `exclude` applies."""
        axes = self._axes()
        for row in product(*axes) if axes else ():
            changes = Section()
            for part in row:
                for key, value in part.items():
                    changes.put(key, value, part.places.get(key))
            where = "entry " + ", ".join(f"{key} = {value}" for key, value in changes.items())
            merged = copy.deepcopy(self.base)
            self._merge(merged, changes, where)
            yield where, changes, merged, True
        cases = self.data.get("cases", [])
        if not isinstance(cases, list) or not all(isinstance(entry, dict | str) for entry in cases):
            allowed = "must be a list of keys and values, such as - {Ca_e: 0.2, d0: 0.1}, and paths of case files"
            self.refuse("cases", cases, allowed)
        for i, entry in enumerate(cases):
            if isinstance(entry, str):
                path = self.path.parent / entry
                content = read_yaml(path)
                name = {"name": path.stem} if is_name(path.stem) else {}  # case.yaml names its case by itself
                entry = Section({**name, **content}, content.places)
            merged = copy.deepcopy(self.base)
            self._merge(merged, entry, f"cases[{i}]")
            yield f"cases[{i}]", flat(entry), merged, False
        if not axes and not cases:
            self.refuse("grid", None, "is missing; must be given, or else zip or cases")

    def _exclusions(self) -> list[dict[str, Any]]:
        entries = self.data.get("exclude", [])
        allowed = "must be a list of keys and values, such as - {Ca_e: 0, De: {min: 1}}"
        if not isinstance(entries, list) or not all(isinstance(entry, dict) and entry for entry in entries):
            self.refuse("exclude", entries, allowed)
        for i, entry in enumerate(entries):
            for key, value in entry.items():
                bounds = value.values() if isinstance(value, dict) else ()
                if not all(map(is_finite, bounds)):
                    self.refuse(f"exclude[{i}]: {key}", value, "must have numbers for min and max")
        return entries

    def grid(self, settings: tuple[str, ...]) -> Grid:
        """Merge the keys of every entry, apply exclusions, validate, and remove duplicates."""
        exclusions = self._exclusions()
        used = [False] * len(exclusions)
        found: dict[str, tuple[Checked, dict[str, Any]]] = {}
        varied: dict[str, None] = {}
        mistakes: dict[tuple[Any, ...], InputError] = {}
        duplicates = excluded = 0
        for where, changes, merged, optional in self._entries():
            varied |= dict.fromkeys(changes)
            hits = [i for i, entry in enumerate(exclusions) if optional and _matches(merged, entry)]
            for i in hits:
                used[i] = True
            if hits:
                excluded += 1
                continue
            apply_settings(merged, settings)
            try:
                checked = self.command.check(merged, str(self.path), where)
            except InputError as error:
                for mistake in error.mistakes:
                    # A mistake in the base occurs in every entry, but is reported once.
                    same = (mistake.file, mistake.line, mistake.key, repr(mistake.value), mistake.allowed)
                    mistakes.setdefault(same, mistake)
                continue
            key = case_key(self.command, checked)
            if key in found:
                duplicates += 1
            else:
                found[key] = (checked, merged)
        if mistakes:
            raise _together(list(mistakes.values()))
        for i, hit in enumerate(used):
            if not hit:
                self.refuse(f"exclude[{i}]", exclusions[i], "must match at least one entry of the grid")
        if not found:
            self.refuse("exclude", None, "must leave at least one case")
        if any(key.startswith(BLOCK) for key in varied):  # the numbers computed from it vary, too
            varied |= dict.fromkeys(NUMBERS)
        values = {
            key: [value_at(checked.resolved, key, value_at(merged, key)) for checked, merged in found.values()]
            for key in varied
        }
        varying = tuple(key for key, column in values.items() if any(value != column[0] for value in column))
        cases = tuple(
            SweepCase(folder_name(checked.slug, key), key, checked, {name: values[name][i] for name in varying})
            for i, (key, (checked, _)) in enumerate(found.items())
        )
        whole = _whole_key(found)
        content = {**self.data, "base": self.base}
        return Grid(self.path, self.name, self.command, cases, varying, whole, duplicates, excluded, content)


def _places(section: Mapping[str, Any]) -> Mapping[str, Place]:
    return section.places if isinstance(section, Section) else {}


def _together(mistakes: Sequence[InputError]) -> InputError:
    """Combine errors into one."""
    first, *rest = (InputError(m.file, m.key, m.value, m.allowed, line=m.line, entry=m.entry) for m in mistakes)
    return InputError(
        first.file, first.key, first.value, first.allowed, line=first.line, entry=first.entry, others=rest
    )


def _whole_key(keys: Iterable[str]) -> str:
    """Hash of a set of cases."""
    return hashlib.sha256("\n".join(sorted(keys)).encode()).hexdigest()


def case_key(command: SweepCommand[Any], checked: Checked) -> str:
    """Hash that identifies a case of a command."""
    return key_of(command.name, checked.identity)


def finished_in(directory: Path, command: SweepCommand[Any], key: str) -> bool:
    """Whether a folder has the finished results of the case with this hash."""
    if read_record(directory).get("status") != "finished":
        return False
    try:
        return case_key(command, command.check(read_yaml(directory / "case.yaml"), "case.yaml")) == key
    except InputError:
        return False


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

"""Grid files: many cases from a base case and what is varied, all of them checked before anything is computed."""

from __future__ import annotations

import copy
import difflib
import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, NoReturn

from pairsim.config.case_file import apply_settings, read_yaml
from pairsim.config.merging import merge
from pairsim.config.ranges import RANGE, spelled_out
from pairsim.runtime.errors import InputError
from pairsim.sweeps.commands import COMMANDS, Checked, SweepCommand, read_told

KEYS = {
    "name": "name of the sweep's folder (default: that of the file)",
    "command": "what is computed for every case: run (default), curve or critical",
    "base": "keys that all cases share, or the path of a case file; may be incomplete",
    "grid": "keys with the values of each, a list or {start, stop, num, spacing: linear or log}; every combination "
    "is a case",
    "zip": "keys with lists of one length, whose entries go together; a list of such groups multiplies",
    "cases": "further cases, each a mapping of keys or the path of a case file; they are not filtered by exclude",
    "exclude": "a list of mappings from keys to a value or {min, max}; combinations that match one of them are left "
    "out, and each of them must match one",
}
"""The keys of a grid file and what they mean."""
MOST_CASES = 100_000
LONGEST_SLUG = 100


@dataclass(frozen=True)
class SweepCase:
    """One case of a sweep.

    Attributes:
        folder: Name of its folder, `<slug>-<beginning of key>`.
        key: Hash of what it computes.
        checked: The validated case.
        parameters: Values of the grid's varying keys.
    """

    folder: str
    key: str
    checked: Checked
    parameters: dict[str, Any]


@dataclass(frozen=True)
class Grid:
    """A grid file, read and checked.

    Attributes:
        source: The file.
        name: Name of the sweep.
        command: What is repeated.
        cases: Every case once, in the order of the file.
        varying: Dotted keys that take more than one value, in the order of the file.
        key: Hash of the set of cases: two grids that compute the same are the same.
        duplicates, excluded: Entries left out.
        content: The file with the base case filled in.
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
        """The sweep of some of the cases, by their indices; for a grid all of whose cases are entries of `cases`."""
        entries = self.content["cases"]
        content = {**self.content, "cases": [entries[i] for i in kept]}
        cases = tuple(self.cases[i] for i in kept)
        return replace(self, cases=cases, key=_whole_key(case.key for case in cases), content=content)

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the results: those of all cases, in the order of their first appearance."""
        own = (name for case in self.cases for name in case.checked.columns)
        return tuple(dict.fromkeys((*own, *self.command.last)))


def read_grid(path: Path, settings: tuple[str, ...] = ()) -> Grid:
    """Read a grid file, merge and check every case.

    Args:
        path: The file.
        settings: key=value settings that replace a key in every case.

    Raises:
        InputError: With the file, the entry, the key, its value and what is allowed.
    """
    return grid_from(path, read_yaml(path), settings)


def grid_from(path: Path, data: dict[str, Any], settings: tuple[str, ...] = ()) -> Grid:
    """As `read_grid`, from the content of a grid file that stands, or could stand, at a path."""
    return _Reader(path, data).grid(settings)


def read_base(path: Path, data: dict[str, Any]) -> dict[str, Any]:
    """The base case of a grid file that stands, or could stand, at a path, its dotted keys spelled out.

    Raises:
        InputError: It is none.
    """
    return _Reader(path, data).base


class _Reader:
    """Takes a grid file apart."""

    def __init__(self, path: Path, data: dict[str, Any]) -> None:
        self.path, self.data = path, data
        for key in data:
            if key not in KEYS:
                near = difflib.get_close_matches(key, KEYS, 1, 0.5)
                hint = f"did you mean {near[0]}? " if near else ""
                self.refuse(key, data[key], f"unknown key; {hint}allowed: {', '.join(KEYS)}")
        name = data.get("command", "run")
        if not isinstance(name, str) or name not in COMMANDS:
            self.refuse("command", name, " or ".join(COMMANDS))
        self.command = COMMANDS[name]
        self.name = data.get("name", path.stem)
        if not isinstance(self.name, str) or not self.name or "/" in self.name or self.name.startswith("."):
            self.refuse("name", self.name, "a word that can name a folder")
        self.base = self._base()

    def refuse(self, key: str, value: Any, allowed: str) -> None:
        raise InputError(str(self.path), key, value, allowed)

    def _base(self) -> dict[str, Any]:
        base = self.data.get("base", {})
        if isinstance(base, str):
            base = read_yaml(self.path.parent / base)
        if not isinstance(base, dict):
            self.refuse("base", base, "keys and values of a case, or the path of a case file")
        merged: dict[str, Any] = {}
        self._merge(merged, base, "base")
        return merged

    def _merge(self, target: dict[str, Any], changes: Mapping[str, Any], where: str) -> None:
        """Put changes (dotted keys allowed) into nested data; groups are merged, everything else is replaced."""

        def refuse(key: str, value: Any, allowed: str) -> NoReturn:
            raise InputError(str(self.path), f"{where}: {key}", value, allowed)

        merge(target, changes, refuse)

    def _values(self, section: str, key: str, value: Any) -> list[Any]:
        """The values that a key takes: a list is one value an item, a range is spelled out."""
        where = f"{section}: {key}"
        if isinstance(value, list):
            if not value:
                self.refuse(where, value, "at least one value")
            return value
        if not isinstance(value, dict) or not set(value) <= set(RANGE):
            allowed = (
                "a list of values or {start, stop, num, spacing: linear or log}; write mesh.Np for a key in a group"
            )
            self.refuse(where, value, allowed)
        try:
            return spelled_out(value, MOST_CASES)
        except ValueError as error:
            self.refuse(where, value, str(error))
        raise AssertionError

    def _axes(self) -> list[list[dict[str, Any]]]:
        """The factors of the product, each a list of changes."""
        axes: list[list[dict[str, Any]]] = []
        grid, zips = self.data.get("grid", {}), self.data.get("zip", {})
        if not isinstance(grid, dict):
            self.refuse("grid", grid, "keys with the values that each takes")
        axes += [[{key: value} for value in self._values("grid", key, values)] for key, values in grid.items()]
        for zipped in zips if isinstance(zips, list) else [zips] if zips else []:
            if not isinstance(zipped, dict) or not zipped:
                self.refuse("zip", zipped, "keys with lists of one length, or a list of such groups")
            columns = {key: self._values("zip", key, values) for key, values in zipped.items()}
            lengths = {key: len(values) for key, values in columns.items()}
            if len(set(lengths.values())) > 1:
                told = ", ".join(f"{key} has {count}" for key, count in lengths.items())
                self.refuse("zip", None, f"all keys must have equally many values; {told}")
            axes.append([dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)])
        seen: set[str] = set()
        for axis in axes:
            if repeated := seen & set(axis[0]):
                self.refuse(sorted(repeated)[0], None, "is varied twice in grid and zip")
            seen |= set(axis[0])
        if math.prod(map(len, axes)) > MOST_CASES:
            self.refuse("grid", None, f"{math.prod(map(len, axes))} cases; at most {MOST_CASES} are allowed")
        return axes

    def _entries(self) -> Iterator[tuple[str, dict[str, Any], dict[str, Any], bool]]:
        """Every entry: where it stands, its changes, the merged keys, and whether `exclude` may drop it."""
        axes = self._axes()
        for row in product(*axes) if axes else ():
            changes = {key: value for part in row for key, value in part.items()}
            where = "entry " + ", ".join(f"{key} = {value}" for key, value in changes.items())
            merged = copy.deepcopy(self.base)
            self._merge(merged, changes, where)
            yield where, changes, merged, True
        cases = self.data.get("cases", [])
        if not isinstance(cases, list) or not all(isinstance(entry, dict | str) for entry in cases):
            allowed = "a list of keys and values, such as - {Ca_e: 0.2, d0: 0.1}, and paths of case files"
            self.refuse("cases", cases, allowed)
        for i, entry in enumerate(cases):
            if isinstance(entry, str):
                path = self.path.parent / entry
                entry = {"name": path.stem, **read_yaml(path)}
            merged = copy.deepcopy(self.base)
            self._merge(merged, entry, f"cases[{i}]")
            yield f"cases[{i}]", flat(entry), merged, False
        if not axes and not cases:
            self.refuse("grid", None, "is missing; a sweep needs grid, zip or cases")

    def _exclusions(self) -> list[dict[str, Any]]:
        entries = self.data.get("exclude", [])
        allowed = "a list of keys and values, such as - {Ca_e: 0, De: {min: 1}}"
        if not isinstance(entries, list) or not all(isinstance(entry, dict) and entry for entry in entries):
            self.refuse("exclude", entries, allowed)
        for i, entry in enumerate(entries):
            for key, value in entry.items():
                bounds = value.values() if isinstance(value, dict) else ()
                if any(isinstance(bound, bool) or not isinstance(bound, int | float) for bound in bounds):
                    self.refuse(f"exclude[{i}]: {key}", value, "numbers for min and max")
        return entries

    def grid(self, settings: tuple[str, ...]) -> Grid:
        """Merge, leave out, check, and remove duplicates."""
        exclusions = self._exclusions()
        used = [False] * len(exclusions)
        found: dict[str, tuple[Checked, dict[str, Any]]] = {}
        varied: dict[str, None] = {}
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
            checked = self.command.check(merged, f"{self.path}: {where}")
            key = case_key(self.command, checked)
            if key in found:
                duplicates += 1
            else:
                found[key] = (checked, merged)
        for i, hit in enumerate(used):
            if not hit:
                self.refuse(f"exclude[{i}]", exclusions[i], "matches no entry of the grid")
        if not found:
            self.refuse("exclude", None, "leaves no case")
        values = {
            key: [value_at(checked.resolved, key, value_at(merged, key)) for checked, merged in found.values()]
            for key in varied
        }
        varying = tuple(key for key, column in values.items() if any(value != column[0] for value in column))
        cases = tuple(
            SweepCase(
                f"{checked.slug[:LONGEST_SLUG]}-{key[:10]}", key, checked, {name: values[name][i] for name in varying}
            )
            for i, (key, (checked, _)) in enumerate(found.items())
        )
        whole = _whole_key(found)
        content = {**self.data, "base": self.base}
        return Grid(self.path, self.name, self.command, cases, varying, whole, duplicates, excluded, content)


def _whole_key(keys: Iterable[str]) -> str:
    """Hash of a set of cases."""
    return hashlib.sha256("\n".join(sorted(keys)).encode()).hexdigest()


def case_key(command: SweepCommand[Any], checked: Checked) -> str:
    """Hash of what a case computes."""
    text = json.dumps({"command": command.name, **checked.identity}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def finished_in(directory: Path, command: SweepCommand[Any], key: str) -> bool:
    """Whether a folder holds a finished computation of the case with this key."""
    if read_told(directory).get("status") != "finished":
        return False
    try:
        return case_key(command, command.check(read_yaml(directory / "case.yaml"), "case.yaml")) == key
    except InputError:
        return False


def _matches(merged: Mapping[str, Any], entry: Mapping[str, Any]) -> bool:
    """Whether every key of an exclusion fits: equal, or between min and max."""

    def fits(value: Any, wanted: Any) -> bool:
        if isinstance(wanted, dict) and wanted and set(wanted) <= {"min", "max"}:
            number = isinstance(value, int | float) and not isinstance(value, bool)
            return number and wanted.get("min", -math.inf) <= value <= wanted.get("max", math.inf)
        if isinstance(value, int | float) and isinstance(wanted, int | float):
            return math.isclose(value, wanted, rel_tol=1e-9)
        return bool(value == wanted)

    return all(fits(value_at(merged, key), wanted) for key, wanted in entry.items())


def value_at(data: Mapping[str, Any], dotted: str, default: Any = None) -> Any:
    """Value of a dotted key."""
    value: Any = data
    for part in dotted.split("."):
        if not isinstance(value, Mapping) or part not in value:
            return default
        value = value[part]
    return value


def flat(entry: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested keys as dotted ones."""
    spelled: dict[str, Any] = {}
    for key, value in entry.items():
        spelled |= flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return spelled

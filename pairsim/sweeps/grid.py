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
from typing import Any

from pairsim.cases.merging import flat
from pairsim.cases.mistakes import Mistake, Mistakes, input_error
from pairsim.cases.physical import BLOCK, forget_numbers
from pairsim.cases.values import FOLDER_WORDS, fits_a_folder, is_finite, is_name
from pairsim.cases.yaml_file import DEFAULT_LAWS, Section, apply_settings, places_in, read_yaml
from pairsim.computing import QUESTIONS, Question
from pairsim.computing.case_files import check_file, wrong_keys
from pairsim.computing.many_cases import SweepFile, check_sweep
from pairsim.runtime.errors import InputError
from pairsim.sweeps.case import SweepCase
from pairsim.sweeps.reader import file_named, merged_into, value_at

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
    command: Question[Any]
    cases: tuple[SweepCase, ...]
    varying: tuple[str, ...]
    key: str
    duplicates: int
    excluded: int
    content: dict[str, Any]

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
    reader = GridReader(path, data, settings, names, Mistakes())
    grid = reader.grid(partly=bool(reader.mistakes))
    if grid is None:
        raise reader.mistakes.error(reader.count)
    return grid


class GridReader:
    """Reads the content of a grid file; its mistakes are collected.

    Args:
        path, data, settings, names: As for `grid_from`.
        mistakes: Those of the file that the content is from; the cases are then checked key by key only.

    Attributes:
        file: The content without its wrong keys.
        name: Name of the sweep.
        base: The base case.
        count: Number of cases so far.
    """

    def __init__(
        self,
        path: Path,
        data: dict[str, Any],
        settings: tuple[str, ...],
        names: Sequence[str] | None,
        mistakes: Mistakes,
    ) -> None:
        self.path, self.data, self.settings, self.names, self.mistakes = path, data, settings, names, mistakes
        self.count = self.excluded = 0
        file, wrong = check_file("sweep", SweepFile, check_sweep, data, str(path))
        self.refuse(*wrong)
        self.file = file or SweepFile()
        self.name = self.file.name or path.stem
        if not fits_a_folder(self.name):
            wrong_name = f"is the name of the file; name must be given, as {FOLDER_WORDS}"
            self.refuse(Mistake("name", self.name, wrong_name))
        self.base = Section()
        with self.collected():
            if "base" in self.file.model_fields_set:
                base = data.get("base", {})
                base = file_named(path, base, "base", data) if isinstance(base, str) else base
                forget_numbers(base)
                merged_into(self.base, base, (str(path), "base", data))
        self.command = QUESTIONS[self.file.command]

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
                with self.collected():
                    content = file_named(self.path, entry, where, self.data)
                    named = {"name": Path(entry).stem} if is_name(Path(entry).stem) else {}
                    yield where, Section({**named, **content}, content.places), False
            elif isinstance(entry, dict):
                yield where, Section(entry, places_in(entry)), False

    def _checked(self, partly: bool) -> Iterator[tuple[Iterable[str], Section, SweepCase]]:
        """Check every entry that is not excluded; yields changed keys, merged keys and case where they are right."""
        used = set()
        for where, changes, optional in self._entries():
            with self.collected():
                merged = merged_into(copy.deepcopy(self.base), changes, (str(self.path), where, self.data))
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
            unmatched = self.file.exclude[i]
            self.refuse(Mistake(f"exclude[{i}]", unmatched, "must match at least one entry of the grid"))

    def grid(self, partly: bool) -> Grid | None:
        """Merge the keys of every entry, apply exclusions, validate, and remove duplicates.

        Args:
            partly: Whether to check single keys only, in a file with other mistakes.

        Returns:
            The grid; None if there are mistakes.
        """
        found: dict[str, tuple[SweepCase, Section]] = {}
        varied: dict[str, None] = {}
        entries = 0
        for keys, merged, case in self._checked(partly):
            varied |= dict.fromkeys(keys)
            found.setdefault(case.key, (case, merged))
            entries += 1
        if not found and not self.mistakes:
            self.refuse(Mistake("exclude", None, "must leave at least one case"))
        if self.mistakes:
            return None
        if any(key.startswith(BLOCK) for key in varied):  # the numbers computed from it vary, too
            varied |= dict.fromkeys(NUMBERS)
            if any(value_at(merged, f"{BLOCK}.end") is not None for _, merged in found.values()):
                varied["time.end"] = None
        whole = [flat(merged) | flat(case.resolved) for case, merged in found.values()]
        for law in DEFAULT_LAWS.keys() & varied.keys():
            varied |= {key: None for each in whole for key in each if key.startswith(f"{law}.")}
        values = [
            {key: each[key] if key in each else value_at(case.resolved, key, value_at(merged, key)) for key in varied}
            for each, (case, merged) in zip(whole, found.values(), strict=True)
        ]
        varying = tuple(key for key in varied if any(each[key] != values[0][key] for each in values))
        cases = tuple(
            replace(case, parameters={key: each[key] for key in varying})
            for (case, _), each in zip(found.values(), values, strict=True)
        )
        key, duplicates, content = _whole_key(found), entries - len(found), {**self.data, "base": self.base}
        return Grid(self.path, self.name, self.command, cases, varying, key, duplicates, self.excluded, content)


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

"""Study files: one case in many discretisations, all validated before the first one is computed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pairsim.commands import COMMANDS
from pairsim.config.mistakes import Mistake, Mistakes, input_error, missing
from pairsim.config.yaml_file import OPTION, Section, places_in
from pairsim.inputs.case_files import check_file
from pairsim.inputs.many_cases import STUDIED, ZERO, StudyFile, check_study
from pairsim.results.columns import series_columns
from pairsim.runtime.errors import InputError
from pairsim.sweeps.case import SweepCase
from pairsim.sweeps.grid import Grid, check_keys, flat, grid_from, read_base, value_at

OWN = ("command", "repeat")  # keys of a discretisation that do not belong to its case
TABLE = "study.csv"
FROM_AT = "must be left out: it follows from at"


@dataclass(frozen=True)
class Study:
    """A validated study file.

    Attributes:
        name: Name of the study.
        grids: For each command, a grid with a case for each of its discretisations.
        cases: Command and case of every discretisation, in the order of the file.
        varying: Dotted keys in which the discretisations differ, including `command` if there are two.
        quantity: The quantity that is compared: a column, or d_cr.
        over: Whether `at` lists times ("t") or distances ("d").
        at: Times [D_c/U_av] or distances [D_c] of the comparison; empty for the end of a run or a single particle.
        exact: Exact values of the quantity at `at`, None if unknown.
        reference: Index of the discretisation used as reference; None for the one with the most unknowns.
        repeat: Number of repetitions of each discretisation, in the order of the file.
    """

    name: str
    grids: dict[str, Grid]
    cases: tuple[tuple[str, SweepCase], ...]
    varying: tuple[str, ...]
    quantity: str
    over: Literal["t", "d"]
    at: tuple[float, ...]
    exact: tuple[float, ...] | None
    reference: int | None
    repeat: tuple[int, ...]

    def repetition(self, i: int) -> dict[str, Grid]:
        """The grids of the i-th repetition, counted from 0, by command."""
        counts = [(command, n) for (command, _), n in zip(self.cases, self.repeat, strict=True)]
        own = {command: [n for name, n in counts if name == command] for command in self.grids}
        kept = {command: [k for k, n in enumerate(counts) if n > i] for command, counts in own.items()}
        return {command: self.grids[command].part(indices) for command, indices in kept.items() if indices}

    @property
    def column(self) -> str:
        """The column that is evaluated at `at`."""
        return "dU" if self.quantity == ZERO else self.quantity

    @property
    def compared(self) -> tuple[str, ...]:
        """The columns of study.csv that are compared."""
        if self.quantity == ZERO or not self.at:
            return (self.quantity,)
        return tuple(f"{self.quantity}@{place:g}" for place in self.at)

    def values(self, row: Mapping[str, Any]) -> tuple[float, ...]:
        """The values of a row that are compared."""
        return tuple(row[name] for name in self.compared)

    def settings(self, command: str, case: SweepCase) -> dict[str, Any]:
        """The values of a discretisation for the varying keys."""
        return {key: command if key == "command" else value_at(case.resolved, key) for key in self.varying}


def columns(case: SweepCase) -> list[str]:
    """Columns of the results of a case that can be compared in a study."""
    return series_columns(case.resolved.get("particles", 2))[1:]


def read_study(path: Path, data: dict[str, Any], settings: tuple[str, ...] = ()) -> Study:
    """Validate the content of a study file.

    Args:
        path: Path of the file.
        data: Its content.
        settings: key=value settings that replace keys in every case.

    Raises:
        InputError: The file has mistakes; lists file, key, value and what is allowed.
    """
    return _Reader(path, data, settings).study()


class _Reader:
    """Reads the content of a study file; its mistakes are collected, so that all of them are reported at once."""

    def __init__(self, path: Path, data: dict[str, Any], settings: tuple[str, ...]) -> None:
        self.path, self.data, self.settings = path, data, settings
        self.mistakes = Mistakes()
        file, wrong = check_file("study", StudyFile, check_study, data, str(path))
        self._add(wrong)
        self.base: Mapping[str, Any] = {}
        try:
            self.base = read_base(path, data) if file is not None and "base" in file.model_fields_set else {}
        except InputError as error:
            self.mistakes.add(error)
        if file is None:
            raise self.mistakes.error()
        self.file = file
        self._add(self._check_places())
        for setting in settings:
            name, _, value = setting.partition("=")
            if any(_within(name, self._followed(command)) for command in file.commands):
                self.mistakes.add(InputError(OPTION, name, value, FROM_AT))

    def _add(self, mistakes: Iterable[Mistake]) -> None:
        if found := list(mistakes):
            self.mistakes.add(input_error(found, self.data, str(self.path)))

    def _check_places(self) -> Iterator[Mistake]:
        """Find mistakes in `at`, and values in the discretisations that follow from it."""
        file = self.file
        alone = self.base.get("particles", 2) == 1
        if file.places == "d" and file.at and alone:
            yield Mistake("at", file.at, "must be left out: there is only one particle")
        if file.places == "d" and not alone and not self.data.get("at"):
            yield missing("at", "must be the distances at which dU is compared")
        for i, (command, entry) in enumerate(zip(file.commands, file.discretisations, strict=True)):
            for name in flat(entry):
                if _within(name, self._followed(command)):
                    yield Mistake(f"discretisations[{i}].{name}", None, FROM_AT)

    def _followed(self, command: str) -> dict[str, list[float]]:
        """The keys of a case that follow from `at`, with their values."""
        file = self.file
        if not file.at or (command == "run" and file.places == "d"):
            return {}
        return {"d": file.at} if command == "curve" else {"output.times": file.at}

    def _content(self, command: str, own: Iterable[int]) -> dict[str, Any]:
        """The content of a grid file of the discretisations of a command, by index."""
        # A base shared by both commands may have keys that only the other command knows.
        keys = {name: COMMANDS[name].model.model_fields for name in set(self.file.commands) & set(STUDIED)}
        kept = {
            key: value
            for key, value in self.base.items()
            if key in keys[command] or not any(key in others for others in keys.values())
        }
        cases = []
        for entry in (self.data["discretisations"][i] for i in own):
            changes = {**self._followed(command), **{key: value for key, value in entry.items() if key not in OWN}}
            cases.append(Section(changes, places_in(entry)))
        base = Section(kept, places_in(self.base))
        return {"name": self.file.name or self.path.stem, "base": base, "command": command, "cases": cases}

    def _grids(self) -> dict[str, Grid]:
        """The grid of each command.

        Raises:
            InputError: The file or a case has mistakes.
        """
        grids: dict[str, Grid] = {}
        partly = bool(self.mistakes)
        for command in dict.fromkeys(name for name in self.file.commands if name in STUDIED):
            own = [i for i, name in enumerate(self.file.commands) if name == command]
            content, names = self._content(command, own), [f"discretisations[{i}]" for i in own]
            try:
                if partly:
                    check_keys(self.path, content, self.settings, names)
                else:
                    grids[command] = grid_from(self.path, content, self.settings, names)
            except InputError as error:
                self.mistakes.add(error)
        for grid in grids.values():
            if grid.duplicates:
                allowed = f"must all differ; {grid.duplicates} are equal to an earlier one"
                self._add([Mistake("discretisations", None, allowed)])
        if self.mistakes:
            raise self.mistakes.error()
        return grids

    def study(self) -> Study:
        """Form the grid of each command, and check the rest of the file against their cases."""
        file, grids = self.file, self._grids()
        in_order = {command: iter(grid.cases) for command, grid in grids.items()}
        cases = tuple((command, next(in_order[command])) for command in file.commands)
        keys = dict.fromkeys(key for entry in file.discretisations for key in flat(entry) if key not in ("name", *OWN))
        resolved = [case.resolved for _, case in cases]
        varying = [key for key in keys if any(value_at(r, key) != value_at(resolved[0], key) for r in resolved)]
        varying[:0] = ["command"] if len(grids) > 1 else []

        known = sorted({name for _, case in cases for name in columns(case)})
        if set(grids) == {"curve"} and all(r.get("particles", 2) == 2 for r in resolved):
            known.append(ZERO)
        quantity = file.quantity or ("dU" if "dU" in known else known[0])
        if quantity not in known:
            unknown = Mistake("quantity", quantity, f"must be one of {', '.join(known)}")
            raise input_error([unknown], self.data, str(self.path))
        name = next(iter(grids.values())).name
        exact = None if file.exact is None else tuple(file.exact)
        reference = None if file.reference == "finest" else file.reference
        varied, at, repeat = tuple(varying), tuple(file.at), tuple(file.repeats)
        return Study(name, grids, cases, varied, quantity, file.places, at, exact, reference, repeat)


def _within(name: str, keys: Iterable[str]) -> bool:
    """Whether a dotted key is one of some keys, or in one of them that is a group."""
    return any(name == key or name.startswith(f"{key}.") for key in keys)

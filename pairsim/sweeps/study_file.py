"""Study files: one case in many discretisations, all validated before the first one is computed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pairsim.commands import COMMANDS
from pairsim.config.merging import flat
from pairsim.config.mistakes import Mistake, Mistakes, input_error, missing
from pairsim.config.yaml_file import OPTION, Section, places_in
from pairsim.inputs.many_cases import STUDIED, ZERO, StudyFile, check_study
from pairsim.results.columns import series_columns
from pairsim.runtime.errors import InputError
from pairsim.sweeps.case import SweepCase
from pairsim.sweeps.grid import Grid, GridReader
from pairsim.sweeps.reader import Reader, value_at

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
    reader = Reader(StudyFile, check_study, path, data, settings, Mistakes())
    if (file := reader.file) is None:
        raise reader.mistakes.error()
    reader.refuse(*_misplaced(file, reader))
    for setting in settings:
        name, _, value = setting.partition("=")
        if any(_within(name, _followed(file, command)) for command in file.commands):
            reader.mistakes.add(InputError(OPTION, name, value, FROM_AT))
    grids = _grids(file, reader)
    if reader.mistakes:
        raise reader.mistakes.error(len(file.discretisations))
    in_order = {command: iter(grid.cases) for command, grid in grids.items()}
    cases = tuple((command, next(in_order[command])) for command in file.commands)
    keys = dict.fromkeys(key for entry in file.discretisations for key in flat(entry) if key not in ("name", *OWN))
    resolved = [case.resolved for _, case in cases]
    varying = [key for key in keys if any(value_at(each, key) != value_at(resolved[0], key) for each in resolved)]
    return Study(
        reader.name,
        grids,
        cases,
        ("command", *varying) if len(grids) > 1 else tuple(varying),
        _quantity(file, cases, reader),
        file.places,
        tuple(file.at),
        None if file.exact is None else tuple(file.exact),
        None if file.reference == "finest" else file.reference,
        tuple(file.repeats),
    )


def _misplaced(file: StudyFile, reader: Reader[StudyFile]) -> Iterator[Mistake]:
    """Find mistakes in `at`, and values in the discretisations that follow from it."""
    alone = reader.base.get("particles", 2) == 1
    if file.places == "d" and file.at and alone:
        yield Mistake("at", file.at, "must be left out: there is only one particle")
    if file.places == "d" and not alone and not reader.data.get("at"):
        yield missing("at", "must be the distances at which dU is compared")
    for i, (command, entry) in enumerate(zip(file.commands, file.discretisations, strict=True)):
        for name in flat(entry):
            if _within(name, _followed(file, command)):
                yield Mistake(f"discretisations[{i}].{name}", None, FROM_AT)


def _followed(file: StudyFile, command: str) -> dict[str, list[float]]:
    """The keys of a case that follow from `at`, with their values."""
    if not file.at or (command == "run" and file.places == "d"):
        return {}
    return {"d": file.at} if command == "curve" else {"output.times": file.at}


def _within(name: str, keys: Iterable[str]) -> bool:
    """Whether a dotted key is one of some keys, or in one of them that is a group."""
    return any(name == key or name.startswith(f"{key}.") for key in keys)


def _grids(file: StudyFile, reader: Reader[StudyFile]) -> dict[str, Grid]:
    """The grid of each command; mistakes in their cases are collected."""
    grids: dict[str, Grid] = {}
    partly = bool(reader.mistakes)
    commands = [name for name in STUDIED if name in file.commands]
    for command in sorted(commands, key=file.commands.index):
        own = [i for i, name in enumerate(file.commands) if name == command]
        content, names = _content(file, reader, command, own), [f"discretisations[{i}]" for i in own]
        grid = GridReader(reader.path, content, reader.settings, names, reader.mistakes).grid(partly)
        if grid is not None:
            grids[command] = grid
            if grid.duplicates:
                allowed = f"must all differ; {grid.duplicates} are equal to an earlier one"
                reader.refuse(Mistake("discretisations", None, allowed))
    return grids


def _content(file: StudyFile, reader: Reader[StudyFile], command: str, own: Iterable[int]) -> dict[str, Any]:
    """The content of a grid file of the discretisations of a command, by index."""
    # A base shared by both commands may have keys that only the other command knows.
    fields: dict[str, Any] = {name: COMMANDS[name].model.model_fields for name in STUDIED if name in file.commands}
    foreign = {key for known in fields.values() for key in known} - set(fields[command])
    kept = {key: value for key, value in reader.base.items() if key not in foreign}
    cases = []
    for entry in (reader.data["discretisations"][i] for i in own):
        changes = {key: value for key, value in entry.items() if key not in OWN}
        cases.append(Section({**_followed(file, command), **changes}, places_in(entry)))
    return {"name": reader.name, "base": Section(kept, reader.base.places), "command": command, "cases": cases}


def _quantity(file: StudyFile, cases: Sequence[tuple[str, SweepCase]], reader: Reader[StudyFile]) -> str:
    """The quantity that is compared.

    Raises:
        InputError: The cases have none of this name.
    """
    known = sorted({name for _, case in cases for name in columns(case)})
    if all(command == "curve" and case.resolved.get("particles", 2) == 2 for command, case in cases):
        known.append(ZERO)
    quantity = file.quantity or ("dU" if "dU" in known else known[0])
    if quantity not in known:
        unknown = Mistake("quantity", quantity, f"must be one of {', '.join(known)}")
        raise input_error([unknown], reader.data, str(reader.path))
    return quantity

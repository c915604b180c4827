"""run.json as an object: how a computation went, with which program and machine, and in which units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.quantities.scales import Scales
from pairsim.record.column import Column
from pairsim.record.folder import read_json, write_json
from pairsim.record.run_entries import (
    COMMAND,
    INPUTS,
    KEY,
    KIND,
    MACHINE,
    MESSAGE,
    NOTES,
    PEAK_MEMORY,
    POINTS,
    REASON,
    SCALES,
    SECONDS,
    SIZE,
    STARTED,
    STATUS,
    TIME_STEPS,
    VERSIONS,
    WARNINGS,
    Entries,
)
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.cases.inputs import Input

FILE = "run.json"


@dataclass(frozen=True)
class Record(Mapping[str, Any]):
    """The content of run.json: a mapping of its entries, with attributes for those that all questions share.

    Entries that this version does not know, written by an older or a newer one, are kept.
    """

    content: Mapping[str, object] = field(default_factory=dict)

    @classmethod
    def of(cls, entries: Entries) -> Record:
        """The record with these entries, in this order."""
        return cls({entry.name: value for entry, value in entries.items()})

    @classmethod
    def read(cls, folder: Path) -> Record:
        """The record of a folder; without entries if the file is missing or invalid."""
        return cls(read_json(folder / FILE))

    def write(self, folder: Path) -> None:
        """Write it into a folder.

        Raises:
            OSError: The file cannot be written.
        """
        write_json(folder / FILE, self.content)

    def __getitem__(self, name: str) -> Any:
        return self.content[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.content)

    def __len__(self) -> int:
        return len(self.content)

    def __or__(self, more: Mapping[str, object]) -> Record:
        return Record({**self.content, **more})

    def with_entries(self, entries: Entries) -> Record:
        """The record with further entries, or other values of some."""
        return self | Record.of(entries)

    @property
    def kind(self) -> str:
        """The question; "" where no computation has begun."""
        return KIND.of(self) or ""

    @property
    def status(self) -> str:
        """ "running", "finished", "failed" or "interrupted"; "" where no computation has begun."""
        return STATUS.of(self) or ""

    @property
    def reason(self) -> str:
        """Why it ended, such as "end" or "contact"; "" while it goes on."""
        return REASON.of(self) or ""

    @property
    def message(self) -> str:
        """How it ended, in a line."""
        return MESSAGE.of(self) or ""

    @property
    def command(self) -> str:
        """The command line, or the call in Python; "" where it is not known."""
        return COMMAND.of(self) or ""

    @property
    def started(self) -> str:
        """When it began; "" where it is not known."""
        return STARTED.of(self) or ""

    @property
    def key(self) -> str | None:
        """Hash of the case; None in records of version 0.2, which wrote none."""
        return KEY.of(self)

    @property
    def versions(self) -> Mapping[str, str]:
        """The versions of the program and its libraries, by name."""
        return VERSIONS.of(self) or {}

    @property
    def machine(self) -> Mapping[str, str]:
        """The machine: node, system and processor."""
        return MACHINE.of(self) or {}

    @property
    def wall_time(self) -> float | None:
        """Wall time [s]; None where it is not known."""
        return SECONDS.of(self)

    @property
    def peak_memory(self) -> int | None:
        """Peak memory of the process [bytes]; None where it is not known."""
        return PEAK_MEMORY.of(self)

    @property
    def steps(self) -> int | None:
        """Number of accepted time steps; None if nothing was integrated in time."""
        return TIME_STEPS.of(self)

    @property
    def points(self) -> int | None:
        """Number of points of a curve, or of steady states; None if the question has none."""
        return POINTS.of(self)

    @property
    def unknowns(self) -> int | None:
        """Number of unknowns of the largest linear system; None where it is not known."""
        return SIZE.of(self)

    @property
    def warnings(self) -> Sequence[str]:
        """Warnings about the results."""
        return WARNINGS.of(self) or ()

    @property
    def notes(self) -> Sequence[str]:
        """Remarks that the answer ends with, such as the liquid of the atlas from which it was interpolated."""
        return NOTES.of(self) or ()

    @cached_property
    def scales(self) -> Scales | None:
        """The units of length, velocity and viscosity; None without a `physical` block."""
        if (found := SCALES.of(self)) is None:
            return None
        return Scales(found["length"], found["velocity"], found["stress"] * found["time"])

    def scales_of(self, source: str) -> Scales:
        """The units of length, velocity and viscosity, of a case that must have them.

        Raises:
            InputError: The case has no `physical` block; the message names `source`.
        """
        if self.scales is None:
            raise no_units(source)
        return self.scales

    @cached_property
    def inputs(self) -> list[Input]:
        """The physical quantities by which the case is given; empty without a `physical` block."""
        from pairsim.cases.inputs import Input  # loads numpy

        return [Input(**each) for each in INPUTS.of(self) or ()]

    def cost(self, *columns: Column) -> dict[str, float]:
        """The values of columns of results.csv that are also entries of the record, by name, as far as it has them."""
        return {each.name: self[each.name] for each in columns if each.name in self}


def no_units(source: str) -> InputError:
    """The error if units are needed, but the case has no `physical` block; the message names `source`."""
    return InputError(source, "", None, "must be the result of a case with a physical block (docs/how-to/units.md)")


def scales_for(folders: Sequence[Path], physical: bool | None) -> list[Scales]:
    """The units in which to show the results of folders, one for each; empty if they are to be dimensionless.

    Args:
        folders: The folders.
        physical: True for um, s, um/s and Pa, False for dimensionless numbers; None for units if all cases have a
            `physical` block.

    Raises:
        InputError: `physical` is set, and a case has no such block.
    """
    found = [Record.read(folder).scales for folder in folders] if physical is not False else []
    if physical and None in found:
        raise no_units(str(folders[found.index(None)]))
    return [] if None in found else [each for each in found if each is not None]

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
    """What run.json says, entry by entry as a mapping, and what every question writes as attributes.

    Entries that this version does not know, of an older or a newer one, are kept.
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
        """Hash of the case; version 0.2 wrote none."""
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
        """Wall time [s]."""
        return SECONDS.of(self)

    @property
    def peak_memory(self) -> int | None:
        """Peak memory of the process [bytes]."""
        return PEAK_MEMORY.of(self)

    @property
    def steps(self) -> int | None:
        """Accepted time steps."""
        return TIME_STEPS.of(self)

    @property
    def points(self) -> int | None:
        """Points of a curve, or steady states."""
        return POINTS.of(self)

    @property
    def unknowns(self) -> int | None:
        """Unknowns of the largest linear system."""
        return SIZE.of(self)

    @property
    def warnings(self) -> Sequence[str]:
        """Warnings about the results."""
        return WARNINGS.of(self) or ()

    @property
    def notes(self) -> Sequence[str]:
        """What the answer adds, such as which liquid the atlas has that gave it."""
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
        """The quantities that the case is given by; none without a `physical` block."""
        from pairsim.cases.inputs import Input  # loads numpy

        return [Input(**each) for each in INPUTS.of(self) or ()]

    def cost(self, *columns: Column) -> dict[str, float]:
        """The entries that are columns of results.csv, too, as far as they are known."""
        return {each.name: self[each.name] for each in columns if each.name in self}


def no_units(source: str) -> InputError:
    """The error where units are needed of a case without a `physical` block."""
    return InputError(source, "", None, "must be the result of a case with a physical block (docs/how-to/units.md)")


def scales_for(folders: Sequence[Path], physical: bool | None) -> list[Scales]:
    """The units of the cases of folders; none where numbers are to be dimensionless.

    They are to be in um, s, um/s and Pa if `physical` is True, or None and all cases have a `physical` block.

    Raises:
        InputError: `physical` is set, and a case has no such block.
    """
    found = [Record.read(folder).scales for folder in folders] if physical is not False else []
    if physical and None in found:
        raise no_units(str(folders[found.index(None)]))
    return [] if None in found else [each for each in found if each is not None]

"""The scales of cases in folders of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pairsim.quantities.scales import Scales
from pairsim.runtime.errors import InputError


def scales_in(record: Mapping[str, Any]) -> Scales | None:
    """The units of length, velocity and stress, in SI units, in run.json; None without a `physical` block."""
    scales = record.get("scales")
    return None if scales is None else Scales(scales["length"], scales["velocity"], scales["stress"] * scales["time"])


def no_units(source: str) -> InputError:
    """The error where units are needed of a case without a `physical` block."""
    return InputError(source, "", None, "must be the result of a case with a physical block (docs/how-to/units.md)")


def scales_for(folders: Sequence[Path], physical: bool | None) -> list[Scales]:
    """The units of the cases of folders; none where numbers are to be dimensionless.

    They are to be in um, s, um/s and Pa if `physical` is True, or None and all cases have a `physical` block.

    Raises:
        InputError: `physical` is set, and a case has no such block.
    """
    from pairsim.results.folder import read_record  # loads what reads YAML

    found = [scales_in(read_record(folder)) for folder in folders] if physical is not False else []
    if physical and None in found:
        raise no_units(str(folders[found.index(None)]))
    return [] if None in found else [each for each in found if each is not None]

"""Tables with units in the header: dimensionless, or converted to micrometres, seconds and pascals."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from pairsim.physics.scales import Scales
from pairsim.results.columns import LENGTH, RATE, STRESS, TIME, VELOCITY, column
from pairsim.results.folders import valid_record
from pairsim.runtime.errors import InputError


class Unit(NamedTuple):
    """How a unit of pairsim is written in a header, and the physical one with its factor."""

    plain: str
    physical: str
    factor: Callable[[Scales], float]


UNITS = {
    TIME: Unit("D_c/U_av", "s", lambda scales: scales.time),
    LENGTH: Unit("D_c", "um", lambda scales: 1e6 * scales.length),
    VELOCITY: Unit("U_av", "um/s", lambda scales: 1e6 * scales.velocity),
    STRESS: Unit("eta_0 U_av/D_c", "Pa", lambda scales: scales.stress),
    RATE: Unit("U_av/D_c", "1/s", lambda scales: 1 / scales.time),
}


def scales_of(directory: Path) -> Scales:
    """The units of length, velocity and stress, in SI units, of the case in a folder.

    Raises:
        InputError: The case has no `physical` block.
    """
    scales = valid_record(directory).get("scales")
    if scales is None:
        raise InputError(
            str(directory), "", None, "must be the result of a case with a physical block (docs/how-to/units.md)"
        )
    return Scales(scales["length"], scales["velocity"], scales["stress"] * scales["time"])


def table_of(directory: Path, name: str, physical: bool) -> str:
    """A table as CSV text, with the unit of each column after its name.

    Args:
        directory: Folder of a command for one case.
        name: Name of the table, without .csv.
        physical: Whether to convert to micrometres, seconds and pascals.

    Raises:
        InputError: The table cannot be read, or `physical` is set and its case has no `physical` block.
    """
    path = directory / f"{name}.csv"
    scales = scales_of(directory) if physical else None
    try:
        written = path.read_text(encoding="utf-8")
        whole = written[: written.rfind("\n") + 1]  # without an incomplete last row of a running computation
        table = pd.read_csv(io.StringIO(whole), dtype=str, keep_default_na=False)
        units = {each: UNITS[unit] for each in map(str, table) if (unit := column(each).unit)}
    except KeyError as error:
        raise InputError(str(path), "", error.args[0], "must be a column of `pairsim`") from None
    except (OSError, ValueError) as error:
        raise InputError(str(path), "", None, f"cannot be read ({error})") from None
    if scales is not None:
        try:
            table = table.assign(**{each: table[each].astype(float) * of.factor(scales) for each, of in units.items()})
        except ValueError as error:
            raise InputError(str(path), "", None, f"must have numbers in its rows ({error})") from None
    headers = {each: f"{each} [{of.physical if physical else of.plain}]" for each, of in units.items()}
    return table.rename(columns=headers).to_csv(index=False, na_rep="nan")

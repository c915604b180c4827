"""Tables with units in the header: dimensionless, or converted to micrometres, seconds and pascals."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

from pairsim.physics.scales import Scales
from pairsim.results.columns import LENGTH, RATE, STRESS, TIME, VELOCITY, column
from pairsim.results.folders import valid_record
from pairsim.runtime.errors import InputError

PHYSICAL: dict[str, tuple[str, Callable[[Scales], float]]] = {
    TIME: ("s", lambda scales: scales.time),
    LENGTH: ("um", lambda scales: 1e6 * scales.length),
    VELOCITY: ("um/s", lambda scales: 1e6 * scales.velocity),
    STRESS: ("Pa", lambda scales: scales.stress),
    RATE: ("1/s", lambda scales: 1 / scales.time),
}
"""For each unit of pairsim: the physical unit in the header, and the conversion factor."""
PLAIN = {TIME: "D_c/U_av", LENGTH: "D_c", VELOCITY: "U_av", STRESS: "eta_0 U_av/D_c", RATE: "U_av/D_c"}


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
        header, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
        units = [column(each).unit for each in header]
    except KeyError as error:
        raise InputError(str(path), "", error.args[0], "must be a column of `pairsim`") from None
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(str(path), "", None, f"cannot be read ({error})") from None
    factors = [PHYSICAL[unit][1](scales) if scales is not None and unit else None for unit in units]
    shown = {unit: text for unit, (text, _) in PHYSICAL.items()} if physical else PLAIN
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(f"{each} [{shown[unit]}]" if unit else each for each, unit in zip(header, units, strict=True))
    for row in rows:
        if len(row) == len(header):  # skips an incomplete last row of a running computation
            pairs = zip(row, factors, strict=True)
            try:
                writer.writerow(value if factor is None else repr(float(value) * factor) for value, factor in pairs)
            except ValueError as error:
                raise InputError(str(path), "", None, f"must have numbers in its rows ({error})") from None
    return text.getvalue()

"""Tables of a folder with units in their headers: those of pairsim, or micrometres, seconds and pascals."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

from pairsim.physics.scales import Scales
from pairsim.results.columns import LENGTH, RATE, STRESS, TIME, VELOCITY, column
from pairsim.results.folders import Kind, kind_of
from pairsim.results.standing import read_record
from pairsim.runtime.errors import InputError

TABLES: dict[Kind, tuple[str, ...]] = {
    "run": ("series",),
    "curve": ("curve", "equilibria"),
    "critical": ("critical",),
}
"""Tables of each kind of folder, the main one first."""
PHYSICAL: dict[str, tuple[str, Callable[[Scales], float]]] = {
    TIME: ("s", lambda scales: scales.time),
    LENGTH: ("um", lambda scales: 1e6 * scales.length),
    VELOCITY: ("um/s", lambda scales: 1e6 * scales.velocity),
    STRESS: ("Pa", lambda scales: scales.stress),
    RATE: ("1/s", lambda scales: 1 / scales.time),
}
"""Units of columns in the headers, and what a unit of pairsim is in them."""
PLAIN = {TIME: "D_c/U_av", LENGTH: "D_c", VELOCITY: "U_av", STRESS: "eta_0 U_av/D_c", RATE: "U_av/D_c"}


def scales_of(directory: Path) -> Scales:
    """The units of a folder's case in SI units.

    Raises:
        InputError: The case was given without units.
    """
    told = read_record(directory).get("scales")
    if told is None:
        raise InputError(
            str(directory), "", None, "has no units: its case has no physical block (docs/how-to/units.md)"
        )
    return Scales(told["length"], told["velocity"], told["stress"] * told["time"])


def table_of(directory: Path, name: str | None, physical: bool) -> str:
    """A table as CSV, with a unit after the name of each column that has one.

    Args:
        directory: Folder of a run, curve or search for critical distances.
        name: One of its `TABLES`, None for the main one.
        physical: Convert to micrometres, seconds and pascals.

    Raises:
        InputError: The folder has no such table, or no units to convert to.
    """
    kind = kind_of(directory)
    if kind not in TABLES:
        raise InputError(str(directory), "", None, f"holds a {kind}; must be the folder of a run, curve or critical")
    if name is not None and name not in TABLES[kind]:
        raise InputError(str(directory), "", name, f"must be {' or '.join(TABLES[kind])}, the tables of a {kind}")
    path = directory / f"{name or TABLES[kind][0]}.csv"
    scales = scales_of(directory) if physical else None
    try:
        header, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
    except (OSError, ValueError) as error:
        raise InputError(str(path), "", None, f"cannot be read ({error})") from None
    units = [column(each).unit for each in header]
    factors = [PHYSICAL[unit][1](scales) if scales is not None and unit else None for unit in units]
    words = {unit: word for unit, (word, _) in PHYSICAL.items()} if physical else PLAIN
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(f"{each} [{words[unit]}]" if unit else each for each, unit in zip(header, units, strict=True))
    for row in rows:
        if len(row) == len(header):  # the last one of a run at work may be half written
            pairs = zip(row, factors, strict=True)
            writer.writerow(value if factor is None else repr(float(value) * factor) for value, factor in pairs)
    return text.getvalue()

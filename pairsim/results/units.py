"""Units of the columns of all tables, dimensionless and physical."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pairsim.physics.scales import Scales
from pairsim.results.columns import AREA, FORCE, LENGTH, RATE, STRESS, TIME, VELOCITY, column
from pairsim.runtime.errors import InputError

UNITS: dict[str, tuple[str, str, Callable[[Scales], float]]] = {
    TIME: ("D_c/U_av", "s", lambda scales: scales.time),
    LENGTH: ("D_c", "um", lambda scales: 1e6 * scales.length),
    VELOCITY: ("U_av", "um/s", lambda scales: 1e6 * scales.velocity),
    STRESS: ("eta_0 U_av/D_c", "Pa", lambda scales: scales.stress),
    RATE: ("U_av/D_c", "1/s", lambda scales: 1 / scales.time),
    AREA: ("D_c^2", "um^2", lambda scales: 1e12 * scales.length**2),
    FORCE: ("eta_0 U_av D_c", "nN", lambda scales: 1e9 * scales.stress * scales.length**2),
}
"""For each unit of a column: its name, the physical unit, and the factor from the one to the other."""


def unit_of(name: str) -> str:
    """The unit of a column of pairsim; "" of others and of pure numbers."""
    try:
        return column(name).unit
    except KeyError:  # of another table
        return ""


def factor(scales: Scales | None, unit: str) -> float:
    """The factor from a unit of the columns to the physical one; 1 without scales, and for pure numbers."""
    return UNITS[unit][2](scales) if scales is not None and unit in UNITS else 1.0


def scales_in(record: Mapping[str, Any]) -> Scales | None:
    """The units of length, velocity and stress, in SI units, in run.json; None without a `physical` block."""
    scales = record.get("scales")
    return None if scales is None else Scales(scales["length"], scales["velocity"], scales["stress"] * scales["time"])


def scales_of(record: Mapping[str, Any], source: str) -> Scales:
    """As `scales_in`, where they are needed.

    Args:
        record: The content of run.json.
        source: Name of its folder for messages.

    Raises:
        InputError: The case has no `physical` block.
    """
    if (scales := scales_in(record)) is None:
        allowed = "must be the result of a case with a physical block (docs/how-to/units.md)"
        raise InputError(source, "", None, allowed)
    return scales


def with_error(value: float, error: float | None, sign: str = "") -> str:
    """A number with its error: (1.567 +- 0.004)e-3.

    Args:
        value: The number.
        error: Half-width of its interval, shown to one digit (two where it begins with 1). None: the number is shown to
            four digits.
        sign: "+" shows the sign of positive numbers, too.
    """
    if error is None or not np.isfinite(error) or error <= 0:
        return f"{value:{sign}.4g}"
    exponent = int(np.floor(np.log10(max(abs(value), error))))
    scale = 1.0 if -2 <= exponent < 4 else 10.0**exponent
    digits = -int(np.floor(np.log10(error / scale)))
    digits += round(error / scale * 10.0**digits) == 1  # two digits of an error that begins with 1
    digits = max(digits, 0)
    text = f"{value / scale:{sign}.{digits}f} +- {error / scale:.{digits}f}"
    return text if scale == 1.0 else f"({text})e{exponent}"


def in_unit(scales: Scales, unit: str, value: float, error: float | None = None, sign: str = "") -> str:
    """A number with its error in the physical unit that belongs to a unit of the columns, such as 10.0 +- 0.5 um."""
    by = factor(scales, unit)
    return f"{with_error(by * value, None if error is None else by * error, sign)} {UNITS[unit][1]}"

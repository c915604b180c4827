"""Numbers with their errors as text, dimensionless or in physical units."""

from __future__ import annotations

import math

from pairsim.quantities.kinds import STRESS, Kind
from pairsim.quantities.scales import Scales


def with_error(value: float, error: float | None, sign: str = "", digits: int = 4) -> str:
    """A number with its error: (1.567 +- 0.004)e-3.

    Args:
        value: The number.
        error: Half-width of its interval, shown to one digit (two where it begins with 1).
        sign: "+" shows the sign of positive numbers, too.
        digits: Significant digits of a number without an error.
    """
    if error is None or not math.isfinite(error) or error <= 0:
        rounded = float(f"{value:.{digits}g}")
        return f"{rounded:{sign if value else ''}.{max(digits, 6)}g}"  # 1060 rather than 1.06e+03
    exponent = math.floor(math.log10(max(abs(value), error)))
    scale = 1.0 if -2 <= exponent < 6 else 10.0**exponent
    digits = _decimals(error / scale)
    value, error = round(value / scale, digits), round(error / scale, digits)
    text = f"{value:{sign if value else ''}z.{max(digits, 0)}f} +- {error:.{max(digits, 0)}f}"
    return text if scale == 1.0 else f"({text})e{exponent}"


def _decimals(error: float) -> int:
    """The decimals of a number with an error: one digit of the error, two where it begins with 1."""
    digits = -math.floor(math.log10(error))
    return digits + (round(error * 10.0**digits) == 1)


def softness(Ca_e: float, scales: Scales | None) -> str:
    """Ca_e in words, such as "Ca_e = 0.1 (G_p = 1500 Pa)" with the modulus in an experiment."""
    text = f"Ca_e = {Ca_e:.4g}"
    return text if scales is None else f"{text} (G_p = {in_unit(scales, STRESS, 1 / Ca_e)})"


def in_unit(
    scales: Scales | None, unit: Kind, value: float, error: float | None = None, sign: str = "", digits: int = 4
) -> str:
    """A number with its error as by `with_error`, in the physical unit, such as 10.0 +- 0.5 um, if there are scales."""
    size = unit.factor(scales)
    text = with_error(size * value, None if error is None else size * error, sign, digits)
    return text if scales is None else f"{text} {unit.physical}".rstrip()  # pure numbers have no unit


def as_known(scales: Scales | None, unit: Kind, value: float, error: float | None, digits: int = 4) -> str:
    """A number as by `in_unit`, without its error but rounded to its decimals: 66 um for 66 +- 6 um.

    Args:
        scales, unit, value: As for `in_unit`.
        error: Half-width of its interval; the number is not rounded if this is None or not below its absolute value.
        digits: Largest number of significant digits.
    """
    size = unit.factor(scales)
    if error is not None and 0 < error < abs(value):
        value = round(size * value, _decimals(size * error)) / size
    return in_unit(scales, unit, value, digits=digits)


def with_name(scales: Scales | None, unit: Kind, value: float, error: float | None = None, digits: int = 4) -> str:
    """A number as by `in_unit`, but with the name of its unit also without scales, such as 0.2 D_c."""
    return in_unit(scales, unit, value, error, digits=digits) + (f" {unit.name}" if scales is None else "")

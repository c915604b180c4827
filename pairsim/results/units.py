"""The units of columns, dimensionless and physical, and numbers with their errors as text."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pairsim.physics.scales import Scales
from pairsim.runtime.errors import InputError


@dataclass(frozen=True)
class Unit:
    """A unit of columns: its name, that of the physical unit in its place ("" of pure numbers), and its size there."""

    name: str = ""
    physical: str = ""
    size: Callable[[Scales], float] = lambda _: 1.0

    @property
    def tex(self) -> str:
        return self.name.replace("eta_0", r"\eta_0").replace("U_av", "U_{av}")

    def factor(self, scales: Scales | None) -> float:
        """The factor to the physical unit; 1 without scales."""
        return 1.0 if scales is None else self.size(scales)


PURE = Unit()
TIME = Unit("D_c/U_av", "s", lambda scales: scales.time)
LENGTH = Unit("D_c", "um", lambda scales: 1e6 * scales.length)
POSITION = Unit("D_c", "mm", lambda scales: 1e3 * scales.length)
VELOCITY = Unit("U_av", "um/s", lambda scales: 1e6 * scales.velocity)
STRESS = Unit("eta_0 U_av/D_c", "Pa", lambda scales: scales.stress)
RATE = Unit("U_av/D_c", "1/s", lambda scales: 1 / scales.time)
AREA = Unit("D_c^2", "um^2", lambda scales: 1e12 * scales.length**2)
VOLUME = Unit("D_c^3", "um^3", lambda scales: 1e18 * scales.length**3)
FORCE = Unit("eta_0 U_av D_c", "nN", lambda scales: 1e9 * scales.stress * scales.length**2)
SECONDS = Unit("s", "s")


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


def with_error(value: float, error: float | None, sign: str = "", digits: int = 4) -> str:
    """A number with its error: (1.567 +- 0.004)e-3.

    Args:
        value: The number.
        error: Half-width of its interval, shown to one digit (two where it begins with 1).
        sign: "+" shows the sign of positive numbers, too.
        digits: Those of a number without an error.
    """
    if error is None or not math.isfinite(error) or error <= 0:
        return f"{value:{sign if value else ''}.{digits}g}"
    exponent = math.floor(math.log10(max(abs(value), error)))
    scale = 1.0 if -2 <= exponent < 6 else 10.0**exponent
    digits = -math.floor(math.log10(error / scale))
    digits += round(error / scale * 10.0**digits) == 1  # two digits of an error that begins with 1
    value, error = round(value / scale, digits), round(error / scale, digits)
    text = f"{value:{sign}.{max(digits, 0)}f} +- {error:.{max(digits, 0)}f}"
    return text if scale == 1.0 else f"({text})e{exponent}"


def softness(Ca_e: float, scales: Scales | None) -> str:
    """Ca_e in words, such as "Ca_e = 0.1 (G_p = 1500 Pa)" with the modulus in an experiment."""
    text = f"Ca_e = {Ca_e:.4g}"
    return text if scales is None else f"{text} (G_p = {in_unit(scales, STRESS, 1 / Ca_e)})"


def in_unit(
    scales: Scales | None, unit: Unit, value: float, error: float | None = None, sign: str = "", digits: int = 4
) -> str:
    """A number with its error as `with_error`, in the physical unit such as 10.0 +- 0.5 um; without scales as it is."""
    size = unit.factor(scales)
    text = with_error(size * value, None if error is None else size * error, sign, digits)
    return text if scales is None else f"{text} {unit.physical}"


def with_name(scales: Scales | None, unit: Unit, value: float, error: float | None = None, digits: int = 4) -> str:
    """A number as `in_unit`, with the name of its unit where there are no scales, too."""
    return in_unit(scales, unit, value, error, digits=digits) + (f" {unit.name}" if scales is None else "")

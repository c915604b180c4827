"""Quantities far from what is usual, as one is whose prefix was misread: 3 mPa for 3 kPa."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

VISCOSITY = 1e-5, 1e5, "0.01 mPa.s to 100 kPa.s"
TIME = 1e-8, 1e5, "10 ns to 1e5 s"
USUAL = {
    "tube": (1e-7, 1.0, "100 nm to 1 m"),
    "particle": (1e-8, 0.1, "10 nm to 10 cm"),
    "velocity": (1e-10, 100.0, "0.1 nm/s to 100 m/s"),
    "flow_rate": (1e-18, 1e-2, "1 pl/s to 10 l/s"),
    "modulus": (1.0, 1e11, "1 Pa to 100 GPa"),
    "young": (1.0, 1e12, "1 Pa to 1000 GPa"),
    "viscosity": VISCOSITY,
    "plastic_viscosity": VISCOSITY,
    "particle_viscosity": VISCOSITY,
    "solvent": VISCOSITY,
    "viscosity_inf": VISCOSITY,
    "relaxation": TIME,
    "time_constant": TIME,
    "yield_stress": (1e-4, 1e6, "0.1 mPa to 1 MPa"),
    "density": (10.0, 3e4, "10 to 30,000 kg/m^3"),
}
"""Least and largest usual value of a quantity of the `physical` block in SI units, and both in words; chosen."""
PREFIX = re.compile(r"[\d.\s]([mM])(?=Pa|P\b|s\b|l/|m\b|m/)")
MEANS = {"m": "m is milli, mega is M", "M": "M is mega, milli is m"}


def unusual(block: Mapping[str, Any], values: Mapping[str, Any], units: Mapping[str, str]) -> Iterator[str]:
    """Sentences on quantities of a `physical` block that are far from usual.

    Args:
        block: The quantities as they are given.
        values: The same in SI units, by key.
        units: These units.
    """
    for key in (key for key in values if key in USUAL):
        least, most, words = USUAL[key]
        several = values[key] if isinstance(values[key], tuple) else (values[key],)
        given = block[key] if isinstance(block[key], list | tuple) else [block[key]]
        for text, value in zip(given, several, strict=False):
            if value is not None and not least <= value <= most:
                prefix = PREFIX.search(str(text))
                means = f" ({MEANS[prefix[1]]})" if prefix else ""
                yield f"{key} {text} is {value:.3g} {units[key]}{means}, usual are {words}"

"""Expand ranges {start, stop, num, spacing} of case and grid files into their values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pairsim.cases.values import is_finite

RANGE = ("start", "stop", "num", "spacing")


def range_schema(end: Mapping[str, Any], most: int, *spacings: str) -> dict[str, Any]:
    """The JSON schema of a range: that of start and stop, the largest num, and the spacings, the default first."""
    return {
        "type": "object",
        "properties": {
            "start": end,
            "stop": end,
            "num": {"type": "integer", "minimum": 2, "maximum": most},
            "spacing": {"enum": list(spacings)},
        },
        "required": ["start", "stop", "num"],
        "additionalProperties": False,
    }


def spelled_out(described: Mapping[str, Any], most: int, spacing: str = "linear") -> list[float]:
    """Expand a range into its values.

    Args:
        described: The range: start, stop, num and optionally spacing.
        most: Largest num allowed.
        spacing: Spacing if the range has none, "linear" or "log".

    Returns:
        The num values from start to stop.

    Raises:
        ValueError: The range is invalid; says why.
    """
    if missing := [key for key in RANGE[:3] if key not in described]:
        raise ValueError(f"must have start, stop and num; {missing[0]} is missing")
    start, stop, num = (described[key] for key in RANGE[:3])
    if not (is_finite(start) and is_finite(stop)):
        raise ValueError("start and stop must be finite numbers")
    if isinstance(num, bool) or not isinstance(num, int) or not 2 <= num <= most:
        raise ValueError(f"num must be a whole number from 2 to {most}")
    spacing = described.get("spacing", spacing)
    if spacing not in ("linear", "log"):
        raise ValueError("spacing must be linear or log")
    if spacing == "log" and (start <= 0 or stop <= 0):
        raise ValueError("start and stop must be above 0 with spacing: log")
    part = [i / (num - 1) for i in range(num)]
    if spacing == "log":
        values = [math.exp(math.log(start) * (1 - f) + math.log(stop) * f) for f in part]
    else:
        values = [start * (1 - f) + stop * f for f in part]
    # Rounded to twelve digits: 0.30000000000000004 would differ from a 0.3 given elsewhere and lengthen folder names.
    return [float(start), *(float(f"{value:.12g}") for value in values[1:-1]), float(stop)]

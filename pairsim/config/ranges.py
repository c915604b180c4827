"""Ranges {start, stop, num, spacing} in case and grid files, and the values that they stand for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

RANGE = ("start", "stop", "num", "spacing")


def spelled_out(described: Mapping[str, Any], most: int, spacing: str = "linear") -> list[float]:
    """The values of a range.

    Args:
        described: Its start, stop, num and perhaps spacing.
        most: Largest num allowed.
        spacing: What it has where it tells none.

    Raises:
        ValueError: In words, what is wrong with it.
    """
    if missing := [key for key in RANGE[:3] if key not in described]:
        raise ValueError(f"a range has start, stop and num; {missing[0]} is missing")
    start, stop, num = (described[key] for key in RANGE[:3])
    if any(isinstance(value, bool) or not isinstance(value, int | float) for value in (start, stop)):
        raise ValueError("start and stop are numbers")
    if isinstance(num, bool) or not isinstance(num, int) or not 2 <= num <= most:
        raise ValueError(f"num is a whole number from 2 to {most}")
    spacing = described.get("spacing", spacing)
    if spacing not in ("linear", "log"):
        raise ValueError("spacing is linear or log")
    if spacing == "log" and (start <= 0 or stop <= 0):
        raise ValueError("a range with spacing: log lies above 0")
    part = [i / (num - 1) for i in range(num)]
    if spacing == "log":
        values = [math.exp(math.log(start) * (1 - f) + math.log(stop) * f) for f in part]
    else:
        values = [start * (1 - f) + stop * f for f in part]
    # Twelve digits: 0.30000000000000004 would look bad in names and tables, and differ from a 0.3 given elsewhere.
    return [float(start), *(float(f"{value:.12g}") for value in values[1:-1]), float(stop)]

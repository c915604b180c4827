"""Remarks on quantities far outside their usual range, as when a prefix was mistaken: 3 mPa for 3 kPa."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from pairsim.quantities.measurable import Measurable

PREFIX = re.compile(r"[\d.\s]([mM])(?=Pa|P\b|s\b|l/|m\b|m/)")
MEANS = {"m": "m is milli, mega is M", "M": "M is mega, milli is m"}


def unusual(of: Measurable, given: Any, value: Any) -> Iterator[str]:
    """Yield sentences on values of a quantity that are far outside its usual range.

    Args:
        of: The quantity.
        given: The value as it is given, or a list of values.
        value: The same in its SI unit, a tuple for a list; None for invalid values.
    """
    if of.usual is None:
        return
    values = value if isinstance(value, tuple) else (value,)
    for text, number in zip(given if isinstance(given, list | tuple) else [given], values, strict=False):
        if number is not None and not of.usual.least <= number <= of.usual.most:
            prefix = PREFIX.search(str(text))
            means = f" ({MEANS[prefix[1]]})" if prefix else ""
            unit = of.unit.replace("*", ".")
            yield f"{of.key} {text} is {number:.3g} {unit}{means}, but the usual range is {of.usual.words}"

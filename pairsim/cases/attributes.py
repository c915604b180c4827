"""Numbers in the files of instruments, each declared with its unit and its physical range."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from pairsim.cases.quantity_text import si
from pairsim.quantities.kinds import Kind
from pairsim.quantities.measurable import Measurable


@dataclass(frozen=True)
class Attribute:
    """A number that a file gives by name.

    The range is wide enough for every instrument, yet so narrow that most numbers in a wrong unit are outside of it.

    Attributes:
        key: Its name in the file.
        unit: Its unit as files write it, such as "uL/s"; empty for a pure number.
        least: Least value.
        most: Largest value.
        open: Whether the least and the largest value themselves are excluded.
    """

    key: str
    unit: str
    least: float
    most: float
    open: bool = False

    @property
    def allowed(self) -> str:
        """The values allowed, in words, for messages about another value."""
        words = "must be above {:g} and below {:g}" if self.open else "must be from {:g} to {:g}"
        return f"{words.format(self.least, self.most)} {self.unit}".rstrip()

    def holds(self, values: Any) -> Any:
        """Whether each number is in the range, in an array of the same shape; nan is not."""
        values = np.asarray(values, dtype=float)
        if self.open:
            return (values > self.least) & (values < self.most)
        return (values >= self.least) & (values <= self.most)

    def number(self, value: Any) -> float:
        """Convert a value from h5py or JSON, a number or a text that may have a unit, to the unit of the attribute.

        Raises:
            ValueError: The value is not a single number in the range; says what is allowed.
        """
        given = np.asarray(value)
        entry = given.reshape(-1)[0] if given.size == 1 else None
        try:
            number = self._of_text(_text(entry)) if isinstance(entry, str | bytes) else float(entry)  # type: ignore[arg-type]
        except (TypeError, ValueError):
            number = math.nan
        if isinstance(entry, bool | np.bool_) or not self.holds(number):
            one = "must be" if given.size == 1 else "must be one number"
            raise ValueError(self.allowed.replace("must be", one))
        return number

    def _of_text(self, text: str) -> float:
        try:
            return float(text)
        except ValueError:
            unit = self.unit.replace(" ", "*")
            return si(text.replace("°", "deg"), Measurable("", Kind(si=unit), "", f"{self.most:g} {self.unit}"))


def _text(value: str | bytes) -> str:
    return (value.decode(errors="replace") if isinstance(value, bytes) else value).strip()

"""Quantities in messages: numbers with their kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pairsim.quantities.scales import Scales

if TYPE_CHECKING:
    from pairsim.quantities.kinds import Kind


@dataclass(frozen=True)
class Quantity:
    """Numbers of a kind in a message.

    They are kept as the texts that are written without units, and converted from these texts to other units.

    Attributes:
        kind: Their kind.
        texts: The numbers as they are written without units.
        between: What is written between them.
        named: Whether the text without units has the name of the dimensionless unit.
    """

    kind: Kind
    texts: tuple[str, ...]
    between: str = ", "
    named: bool = False

    def __str__(self) -> str:
        text = self.between.join(self.texts)
        return f"{text} {self.kind.name}" if self.named else text

    def in_units(self, scales: Scales | None) -> str:
        """The numbers in the physical unit, with at most five digits; a single 0 needs no unit."""
        if scales is None or not self.kind.physical or self.texts == ("0",):
            return str(self)
        factor = self.kind.factor(scales)
        numbers = (f"{float(text) * factor:{'+' if text.startswith('+') else ''}.5g}" for text in self.texts)
        return f"{self.between.join(numbers)} {self.kind.physical}"

"""How much particles differ from each other."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pairsim.cases.case import SceneCase
from pairsim.cases.keys import Key, Keys, Part
from pairsim.cases.values import Number

Deviation = Annotated[Number, Field(ge=0, le=0.3)]


class SpreadOptions(Keys):
    """Standard deviations among the particles, which are normal and independent, as parts of the means."""

    diameter: Deviation = Field(0.0, description="standard deviation of the diameter of each particle over the mean")
    modulus: Deviation = Field(0.0, description="standard deviation of the modulus of each particle over the mean")

    def __bool__(self) -> bool:
        """Whether the particles differ."""
        return bool(self.diameter or self.modulus)


class SpreadCase(SceneCase):
    """A case whose particles may differ from each other. One of equal particles is as before there was this key."""

    spread: Annotated[SpreadOptions, Key(part=Part.REPORT, identity=lambda case: bool(case.spread))] = SpreadOptions()

"""How much particles differ from each other."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pairsim.cases.case import SceneCase
from pairsim.cases.keys import Key, Keys, Part
from pairsim.cases.values import Number

Deviation = Annotated[Number, Field(ge=0, le=0.3)]


def _check_modulus(case: SpreadCase) -> str:
    return "must be 0: there are rigid particles" if case.spread.modulus and not all(case.Ca_es) else ""


class SpreadOptions(Keys):
    """Standard deviations among the particles, which are normal and independent, as parts of the means."""

    diameter: Deviation = Field(0.0, description="standard deviation of the diameter of each particle over the mean")
    modulus: Annotated[Deviation, Key(check=_check_modulus)] = Field(
        0.0, description="standard deviation of the modulus of each particle over the mean"
    )

    def __bool__(self) -> bool:
        """Whether the particles differ."""
        return bool(self.diameter or self.modulus)


def _check_spread(case: SpreadCase) -> str:
    return "must be left out: it is that of free pairs" if case.spread and not case.of_free_pairs else ""


SPREAD = Key(part=Part.REPORT, identity=lambda case: bool(case.spread), check=_check_spread)


class SpreadCase(SceneCase):
    """A case whose particles may differ from each other. One of equal particles is as before there was this key."""

    spread: Annotated[SpreadOptions, SPREAD] = SpreadOptions()

    @property
    def of_free_pairs(self) -> bool:
        """Whether it is asked what particles do in pairs, or in longer rows, when no force acts on them."""
        return True

"""The key `spread` of a case: how much its particles differ from each other."""

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
    """Standard deviations among the particles, over the means; the particles are drawn normally and independently."""

    diameter: Deviation = Field(
        0.0, description="standard deviation of the diameters of the particles, relative to their mean"
    )
    modulus: Annotated[Deviation, Key(check=_check_modulus)] = Field(
        0.0, description="standard deviation of the moduli of the particles, relative to their mean"
    )

    def __bool__(self) -> bool:
        """Whether the particles differ."""
        return bool(self.diameter or self.modulus)


def _check_spread(case: SpreadCase) -> str:
    return "must be left out: it applies to free pairs only" if case.spread and not case.of_free_pairs else ""


SPREAD = Key(part=Part.REPORT, identity=lambda case: bool(case.spread), check=_check_spread)


class SpreadCase(SceneCase):
    """A case whose particles may differ from each other; if they are equal, `spread` is no part of its identity."""

    spread: Annotated[SpreadOptions, SPREAD] = SpreadOptions()

    @property
    def of_free_pairs(self) -> bool:
        """Whether the case is about force-free particles in pairs or longer rows, for which alone there is a spread."""
        return True

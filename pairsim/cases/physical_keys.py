"""The key `physical` of a case: the pydantic model of its block, made from the declaration of each quantity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, WithJsonSchema, create_model

from pairsim.cases.keys import Keys
from pairsim.cases.physical import KEYS, RANGE_OF_LENGTHS, TUBE
from pairsim.quantities.measurable import EACH, MEAN, Measurable
from pairsim.runtime.plain import Plain


def _field(of: Measurable) -> Any:
    """Type and description of the field of a quantity; `pairsim.cases.experiment` checks its values."""
    one = {"type": "string", "examples": [of.example, of.as_volume] if of.as_volume else [of.example]}
    several: list[Any] = [{"type": "array", "items": one}] if of.many or of.ranged else []
    several += [{"type": "object", "examples": [RANGE_OF_LENGTHS]}] if of.ranged else []
    several += [{"type": "object", "examples": [f"{{{MEAN}: {of.example}, {EACH}: ...}}"]}] if of.each else []
    kind = Annotated[Any, WithJsonSchema({"anyOf": [one, *several]} if several else one)]
    return kind, Field(... if of is TUBE else None, description=of.words)


if TYPE_CHECKING:
    _Keys = Keys
else:
    _Keys = create_model("_Keys", __base__=Keys, **{key: _field(each) for key, each in KEYS.items()})


class Physical(_Keys):
    """Quantities of an experiment. particle, modulus, young: one value for all particles, or a list from upstream."""

    @property
    def given(self) -> dict[str, Plain]:
        """The quantities that are given, as they are written."""
        return {key: value for key, value in self if value is not None}

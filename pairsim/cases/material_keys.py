"""The keys `liquid` and `solid` of a case: pydantic models of their blocks, made from what each law declares."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model

from pairsim.cases.keys import Keys, PerParticle
from pairsim.cases.laws import ELASTIC, MODES, VISCOUS
from pairsim.cases.values import Number
from pairsim.physics import liquids, solids
from pairsim.physics.liquids import ConformationLaw, Newtonian
from pairsim.physics.material import Material, Parameter
from pairsim.runtime.plain import Plain

if TYPE_CHECKING:
    from pydantic.json_schema import JsonSchemaValue

MOST_MODES = 8
MODES_WORDS = "several relaxation times: a list of modes, each with its law"


type _Definition = tuple[Any, Any]
"""The type of a field, and its `Field`."""


def _field(parameter: Parameter) -> _Definition:
    """Type, range, default and description of a parameter."""
    least, most = parameter.least, parameter.most
    bounds = Field(gt=least, le=most) if parameter.open else Field(ge=least, le=most)
    default: Any = ... if parameter.default is None else parameter.default
    return Annotated[Number, bounds], Field(default, description=parameter.words)


def _model(name: str, law: str, words: str, fields: Mapping[str, _Definition], measured: list[str]) -> type[BaseModel]:
    """The model of the block of a law. It is added to the names of this module, so that cases can be pickled.

    Fields that are `measured` may follow from the `physical` block; the JSON Schema therefore does not require them.
    """

    def without_measured(schema: JsonSchemaValue) -> None:
        schema["required"] = [key for key in schema["required"] if key not in measured]

    config = ConfigDict(**Keys.model_config, json_schema_extra=without_measured)
    definitions: Any = {"law": (_names([law]), Field(description=words)), **fields}
    globals()[name] = create_model(name, __config__=config, __doc__=words, __module__=__name__, **definitions)
    return globals()[name]


def _models(
    laws: Mapping[str, type[Material]], more: Mapping[str, _Definition] = MappingProxyType({}), of: str = ""
) -> dict[str, type[BaseModel]]:
    """The models of the blocks of laws, by name of the law.

    Args:
        laws: The laws by name.
        more: Further fields of each block.
        of: Part of the names of the models that distinguishes them from other models of the same laws.
    """
    found = {}
    for name, law in laws.items():
        declared = law.parameters()
        fields = {**{key: _field(each) for key, each in declared.items()}, **more}
        measured = [key for key, each in declared.items() if each.dimension is not None]
        found[name] = _model(f"{law.__name__}{of}Block", name, law.words, fields, measured)
    return found


def _names(laws: Any) -> Any:
    return Literal[*laws]


def _as_block(value: Any) -> Any:
    return {"law": value} if isinstance(value, str) else value


def _block_of(models: Mapping[str, type[BaseModel]]) -> Any:
    """The type of the block of any of these laws; a law may also be given by its name alone."""
    block: Any = Annotated[Union[*models.values()], Field(discriminator="law")]
    return Annotated[block, BeforeValidator(_as_block, json_schema_input_type=_names(models) | block)]


_SOLVENTS = _models(VISCOUS)
_SOLVENT = Field(None, description="viscosity law of the solvent; default: constant viscosity")
_OF_SOLVENT = (_block_of(_SOLVENTS) | None, _SOLVENT)
_OF_MODE = {name: _field(each) for name, each in ConformationLaw.OF_MODE.items()}
_OF_MODES = _models(ELASTIC, _OF_MODE, of="Mode")
_MODES = Field(
    min_length=2,
    max_length=MOST_MODES,
    description="the modes, each with its law and the parameters of the law, its time and its weight; only ratios of "
    "weights matter",
)
_ONE_MODE: Any = Annotated[Union[*_OF_MODES.values()], Field(discriminator="law")]
_YIELDING = _models(liquids.YIELDING)
_YIELDS = Field(None, description="how a yield stress changes the relaxation of the polymer; default: no yield stress")
_OF_LIQUID: dict[str, _Definition] = {"solvent": _OF_SOLVENT, "yielding": (_block_of(_YIELDING) | None, _YIELDS)}
_ELASTIC = _models(ELASTIC, _OF_LIQUID)
_SEVERAL = _model("ModesBlock", MODES, MODES_WORDS, {"modes": (tuple[_ONE_MODE, ...], _MODES), **_OF_LIQUID}, [])
LIQUIDS: dict[str, type[BaseModel]] = {**_SOLVENTS, **_ELASTIC, MODES: _SEVERAL}
"""The model of the block of each liquid."""
SOLIDS = _models(solids.LAWS)  # the model of the block of each solid
BLOCKS = {"liquid": LIQUIDS, "solid": SOLIDS, "solvent": _SOLVENTS, "yielding": _YIELDING, "modes": _OF_MODES}
"""The models of blocks by the key whose values they are, and then by law."""


if TYPE_CHECKING:  # their types depend on values that mypy does not know
    LiquidKey = Any
    SolidKey = Any
else:
    LiquidKey = _block_of(LIQUIDS) | None
    """A liquid: the name of a law, or its block."""
    SolidKey = PerParticle[_block_of(SOLIDS)] | None
    """A solid for all particles, or a list with one for each."""


def written(block: BaseModel | None) -> Any:
    """A block with the defaults of its law, as in a resolved case; the name of the law if that is all."""
    return None if block is None else _shortened(block.model_dump(mode="json", exclude_none=True))


def _shortened(block: dict[str, Plain]) -> Plain:
    if isinstance(solvent := block.pop("solvent", None), dict) and (shorter := _shortened(solvent)) != Newtonian.name:
        block["solvent"] = shorter
    return block if len(block) > 1 else block["law"]

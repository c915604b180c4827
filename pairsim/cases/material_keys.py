"""The keys `liquid` and `solid` of a case: pydantic models of their blocks, made from what each law declares."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal, Union

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, create_model

from pairsim.cases.materials import ELASTIC, MODES, VISCOUS
from pairsim.cases.quantities import many
from pairsim.cases.values import Number
from pairsim.physics import liquids, solids
from pairsim.physics.liquids import ConformationLaw, Newtonian
from pairsim.physics.material import Material, Parameter
from pairsim.physics.own_laws import OPTION

MOST_MODES = 8
MODELS: dict[str, type[BaseModel]] = {}
"""The model of each block by its name, with which errors of pydantic refer to it."""
MODES_WORDS = "several relaxation times: a list of modes, each with its law"


def ranged(parameter: Parameter) -> Any:
    """The type of a key with the range of a parameter."""
    least, most = parameter.least, parameter.most
    bounds = Field(gt=least, le=most) if parameter.open else Field(ge=least, le=most)
    return Annotated[Number, bounds]


def _field(parameter: Parameter) -> Any:
    """Type, default and description of a parameter."""
    default: Any = ... if parameter.default is None else parameter.default
    return ranged(parameter), Field(default, description=parameter.words)


def _made(name: str, words: str, fields: dict[str, Any], measured: Sequence[str] = ()) -> type[BaseModel]:
    """A model that is found in this module, so that a case can be sent to other processes.

    Args:
        name: Its name.
        words: Its description.
        fields: Its fields.
        measured: Those that the `physical` block may give, which the JSON Schema therefore does not require.
    """

    def without_measured(schema: dict[str, Any]) -> None:
        schema["required"] = [key for key in schema["required"] if key not in measured]

    config = ConfigDict(extra="forbid", frozen=True, defer_build=True, json_schema_extra=without_measured)
    model = create_model(name, __config__=config, __doc__=words, __module__=__name__, **fields)
    globals()[name] = MODELS[name] = model
    return model


def _model(law: type[Material], of: str = "", **more: Any) -> type[BaseModel]:
    """The model of the block of a law; `of` distinguishes it from others of the same law."""
    fields = {"law": (_named([law.name]), Field(description=law.words))}
    fields |= {name: _field(each) for name, each in law.parameters().items()}
    measured = [name for name, each in law.parameters().items() if each.dimension is not None]
    return _made(f"{law.__name__}{of}Block", law.words, fields | more, measured)


def _one_of(models: Mapping[str, type[BaseModel]]) -> Any:
    """The type of a block of one of some laws, tagged with the name of its model."""

    def tag(value: Any) -> str | None:
        law = value.get("law") if isinstance(value, Mapping) else getattr(value, "law", None)
        model = models.get(law) if isinstance(law, str) else None
        return model.__name__ if model else None

    by_law = Discriminator(
        tag, custom_error_type="law", custom_error_message="must be a group with law and its parameters"
    )
    return Annotated[Union[*(Annotated[model, Tag(model.__name__)] for model in models.values())], by_law]


def _named(laws: Iterable[str]) -> Any:
    """The type of the name of one of some laws."""
    return Literal[*laws]


def _words(names: list[str], more: str = "") -> str:
    group = f"or a group with law (one of these{more}) and its parameters"
    return f"{', '.join(names)}, {group}; {OPTION} FILE adds laws of your own"


def _of_modes(law: type[ConformationLaw]) -> type[BaseModel]:
    return _model(law, "Mode", **{name: _field(each) for name, each in ConformationLaw.OF_MODE.items()})


_SOLVENTS = {name: _model(law) for name, law in VISCOUS.items()}
_SOLVENT = (
    _named(VISCOUS) | _one_of(_SOLVENTS) | None,
    Field(
        None,
        description="viscosity law of the solvent; default: one of constant viscosity",
        json_schema_extra={"words": _words(list(VISCOUS))},
    ),
)
_MODELS_OF_MODES = {name: _of_modes(law) for name, law in ELASTIC.items()}
_MODES = _made(
    "ModesBlock",
    MODES_WORDS,
    {
        "law": (_named([MODES]), Field(description=MODES_WORDS)),
        "modes": (
            many(_one_of(_MODELS_OF_MODES)),
            Field(
                min_length=2,
                max_length=MOST_MODES,
                description="the modes, each with its law and its parameters, time and weight; of the weights only "
                "their ratios count",
                json_schema_extra={
                    "words": f"a list of 2 to {MOST_MODES} groups with law, time, weight and the parameters of the law"
                },
            ),
        ),
        "solvent": _SOLVENT,
    },
)
LIQUIDS: dict[str, type[BaseModel]] = {
    **_SOLVENTS,
    **{name: _model(law, solvent=_SOLVENT) for name, law in ELASTIC.items()},
    MODES: _MODES,
}
"""The model of the block of each liquid."""
SOLIDS: dict[str, type[BaseModel]] = {name: _model(law) for name, law in solids.LAWS.items()}
"""The model of the block of each solid."""
BLOCKS = {"liquid": LIQUIDS, "solid": SOLIDS}


def material_fields() -> dict[str, Any]:
    """The fields of `liquid` and `solid`."""
    liquid = Field(
        None,
        description=f"constitutive law, or a group with it and its parameters; default: {liquids.DEFAULT.name}, "
        f"{Newtonian.name} at De = 0",
        json_schema_extra={"words": _words([*liquids.LAWS], f", or {MODES}")},
    )
    solid = Field(
        None,
        description="law of the soft particles, or a group with it and its parameters, or a list of these from "
        f"upstream; default: {solids.DEFAULT.name}",
        json_schema_extra={"words": f"{_words([*solids.LAWS])}, or a list of these"},
    )
    one: Any = _named(solids.LAWS) | _one_of(SOLIDS)
    return {
        "liquid": (_named(liquids.LAWS) | _one_of(LIQUIDS) | None, liquid),
        "solid": (one | many(one) | None, solid),
    }

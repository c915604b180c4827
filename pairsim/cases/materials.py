"""The liquid and the solids that a case describes.

A value of `liquid` or `solid` is the name of a law, or a block with its parameters: `{law: ..., n: 0.6}`. The block of
a viscoelastic law may have a `solvent`, a block of its own; a liquid of several relaxation times has `law: modes` and a
list of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple

from pydantic import BaseModel

from pairsim.physics import liquids, solids
from pairsim.physics.declared import LAWS
from pairsim.physics.liquids import NEWTONIAN, ConformationLaw, Liquid, Newtonian, ViscousLaw
from pairsim.physics.material import Material, Parameter
from pairsim.physics.solids import Solid

MODES = "modes"
"""The law of a liquid of several modes in case files."""
VISCOUS = {name: law for name, law in liquids.LAWS.items() if issubclass(law, ViscousLaw)}
ELASTIC = {name: law for name, law in liquids.LAWS.items() if issubclass(law, ConformationLaw)}


def block_of(value: Any, default: str) -> dict[str, Any]:
    """A value of `liquid`, `solvent` or `solid` as a block without the parameters that are not given."""
    if isinstance(value, BaseModel):
        value = value.model_dump(mode="json", exclude_none=True)
    block = dict(value) if isinstance(value, Mapping) else {"law": default if value is None else value}
    law = block.get("law")
    given = {key: entry for key, entry in block.items() if entry is not None}
    return given | {"law": law if isinstance(law, str) else ""}


def liquid_block(case: Mapping[str, Any]) -> dict[str, Any]:
    """The block of the liquid of a case."""
    return block_of(case.get("liquid"), liquids.DEFAULT.name)


def solid_blocks(case: Mapping[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """The blocks of the solids of a case, each with its dotted key: one of all particles, or one of each."""
    value = case.get("solid")
    if isinstance(value, list | tuple):
        return [(f"solid[{i}]", block_of(each, solids.DEFAULT.name)) for i, each in enumerate(value)]
    return [("solid", block_of(value, solids.DEFAULT.name))]


def _numbers(law: type[Material], block: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters of a law among keys and values."""
    return {name: block[name] for name in law.parameters() if block.get(name) is not None}


def modes_in(block: Mapping[str, Any]) -> Sequence[Any]:
    """The blocks of the modes in that of a liquid, none if they are no list."""
    modes = block.get("modes")
    return modes if isinstance(modes, list | tuple) else ()


def is_viscous(case: Mapping[str, Any]) -> bool:
    """Whether the liquid of a case, which need not be validated yet, has a viscosity alone, and so no De."""
    return case.get("liquid") is not None and liquid_block(case).get("law") in VISCOUS


def liquid_of(case: Mapping[str, Any]) -> Liquid:
    """The liquid of a valid case.

    Raises:
        KeyError, TypeError: The case is not valid.
    """
    block = liquid_block(case)
    if is_viscous(case):
        law = VISCOUS[block["law"]]
        return Liquid(law(**_numbers(law, block)))
    if not case.get("De"):
        return NEWTONIAN
    solvent = block_of(block.get("solvent"), Newtonian.name)
    viscosity = VISCOUS[solvent["law"]]
    return Liquid(viscosity(**_numbers(viscosity, solvent)), case["xi"], case["De"], _modes(block, case))


def _modes(block: Mapping[str, Any], case: Mapping[str, Any]) -> tuple[ConformationLaw, ...]:
    if block["law"] != MODES:
        law = ELASTIC[block["law"]]
        return (law(**_numbers(law, block)),)
    modes = [block_of(mode, "") for mode in block["modes"]]
    total = sum(mode["weight"] for mode in modes)

    def each(mode: Mapping[str, Any]) -> ConformationLaw:
        law = ELASTIC[mode["law"]]
        return law(**_numbers(law, mode), time=mode["time"], weight=mode["weight"] / total)

    return tuple(map(each, modes))


def solids_of(case: Mapping[str, Any], Ca_es: tuple[float, ...]) -> tuple[Solid | None, ...]:
    """The solids of a valid case, None for rigid particles.

    Args:
        case: The case.
        Ca_es: Ca_e of each particle.

    Raises:
        KeyError, TypeError: The case is not valid.
    """
    blocks = [block for _, block in solid_blocks(case)]
    blocks = blocks if len(blocks) == len(Ca_es) else blocks[:1] * len(Ca_es)
    laws = [solids.LAWS[block["law"]] for block in blocks]
    return tuple(
        law(Ca_e, **_numbers(law, block)) if Ca_e > 0 else None
        for law, block, Ca_e in zip(laws, blocks, Ca_es, strict=True)
    )


def _if_complete[T](make: Callable[[], T], otherwise: T) -> T:
    """What follows from the materials of a case, or another value where one of their parameters is missing."""
    try:
        return make()
    except (KeyError, TypeError, ValueError):  # which the checks of the case report
        return otherwise


def cells_of(case: Mapping[str, Any]) -> Literal["newtonian", "thinning", "hardening"]:
    """The kind of liquid that decides the cells of a case, whose parameters may be missing."""
    return _if_complete(lambda: liquid_of(case).cells, "thinning")


def slowest_of(case: Mapping[str, Any]) -> float:
    """The longest relaxation time of the liquid over that of De, of a case whose parameters may be missing."""
    return _if_complete(lambda: liquid_of({**case, "De": 1.0}).longest or 1.0, 1.0)


def viscosities_of(case: Mapping[str, Any], Ca_es: tuple[float, ...]) -> list[float]:
    """The viscosity of each particle over eta_0, of a case whose parameters may be missing; 0 for elastic ones."""
    rigid: tuple[Solid | None, ...] = (None,) * len(Ca_es)
    return [
        float(each.viscosity or 0.0) if each else 0.0 for each in _if_complete(lambda: solids_of(case, Ca_es), rigid)
    ]


class Declared(NamedTuple):
    """A parameter of a law that a case names.

    Attributes:
        key: Its dotted key in the case.
        law: Name of the law.
        parameter: Its declaration.
        value: Its value, None if it is not given.
    """

    key: str
    law: str
    parameter: Parameter
    value: Any


def declared_in(case: Mapping[str, Any]) -> Iterator[Declared]:
    """The parameters of the laws that a case names, which need not be validated yet."""
    block = liquid_block(case)
    places = [("liquid", block)]
    if "solvent" in block:
        places.append(("liquid.solvent", block_of(block["solvent"], "")))
    places += [(f"liquid.modes[{i}]", block_of(mode, "")) for i, mode in enumerate(modes_in(block))]
    for place, each in (*places, *solid_blocks(case)):
        laws: Mapping[str, type[Material]] = liquids.LAWS if place.startswith("liquid") else solids.LAWS
        law = laws.get(each["law"])
        if law is None:
            continue
        for name, parameter in law.parameters().items():
            yield Declared(f"{place}.{name}", law.name, parameter, each.get(name))


def resolved_materials(case: Mapping[str, Any], liquid: Liquid) -> dict[str, Any]:
    """The keys of the materials of a case with the defaults of their parameters.

    A law without parameters is written as its name.

    Args:
        case: The validated case.
        liquid: Its liquid.

    Returns:
        The keys `liquid` and `solid`; None for one that is left out.
    """
    default = liquids.DEFAULT.name if liquid.modes else None
    solid = case.get("solid")
    solid = [_resolved(each) for each in solid] if isinstance(solid, list | tuple) else _resolved(solid)
    if isinstance(solid, list) and solid and all(each == solid[0] for each in solid):
        solid = solid[0]
    return {
        "liquid": _resolved(case.get("liquid") or default),
        "solid": None if solid == solids.DEFAULT.name else solid,
    }


def _resolved(value: Any) -> Any:
    """A block with the defaults of its law; the name of the law if that is all."""
    if value is None:
        return None
    block = block_of(value, "")
    if block["law"] != MODES:
        parameters = LAWS[block["law"]].parameters()
        defaults = {name: each.default for name, each in parameters.items() if each.default is not None}
        block = {"law": block["law"], **defaults, **block}
    if "solvent" in block and (solvent := _resolved(block["solvent"])) != Newtonian.name:
        block["solvent"] = solvent
    else:
        block.pop("solvent", None)
    return block if len(block) > 1 else block["law"]

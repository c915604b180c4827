"""The liquid and the solids that a case describes.

A value of `liquid` or `solid` is the name of a law, or a block with its parameters: `{law: ..., n: 0.6}`. The block of
a viscoelastic law may have a `solvent` and, with a yield stress, `yielding`, blocks of their own; a liquid of several
relaxation times has `law: modes` and a list of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from pydantic import BaseModel

from pairsim.physics import liquids, solids
from pairsim.physics.declared import LAWS
from pairsim.physics.liquids import NEWTONIAN, ConformationLaw, Liquid, Newtonian, ViscousLaw
from pairsim.physics.material import Material, Parameter
from pairsim.physics.solids import Solid

MODES = "modes"  # the law of a liquid of several modes in case files
VISCOUS = {name: law for name, law in liquids.LAWS.items() if issubclass(law, ViscousLaw)}
ELASTIC = {name: law for name, law in liquids.LAWS.items() if issubclass(law, ConformationLaw)}


def block_of(value: Any, default: str = "") -> dict[str, Any]:
    """A value of `liquid`, `solvent` or `solid` as a block, without the parameters that are not given."""
    if isinstance(value, BaseModel):
        value = value.model_dump(mode="json", exclude_unset=True)
    block = value if isinstance(value, Mapping) else {"law": default if value is None else value}
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


def is_viscous(case: Mapping[str, Any]) -> bool:
    """Whether the liquid of a case, which need not be validated yet, has a viscosity alone, and so no De."""
    return case.get("liquid") is not None and liquid_block(case)["law"] in VISCOUS


def liquid_of(case: Mapping[str, Any]) -> Liquid:
    """The liquid of a valid case."""
    block = liquid_block(case)
    if is_viscous(case):
        return Liquid(_law(VISCOUS, block))
    if not case.get("De"):
        return NEWTONIAN
    modes = (_law(ELASTIC, block),) if block["law"] != MODES else _modes([block_of(each) for each in block["modes"]])
    solvent = block_of(block.get("solvent"), Newtonian.name)
    yielding = _law(liquids.YIELDING, block_of(block["yielding"])) if "yielding" in block else None
    return Liquid(_law(VISCOUS, solvent), case["xi"], case["De"], modes, yielding)


def _law[M: Material](laws: Mapping[str, type[M]], block: Mapping[str, Any], *first: float, **more: float) -> M:
    """The law of a block with the parameters in it."""
    law = laws[block["law"]]
    return law(*first, **{name: block[name] for name in law.parameters() if name in block}, **more)


def _modes(blocks: list[dict[str, Any]]) -> tuple[ConformationLaw, ...]:
    total = sum(block["weight"] for block in blocks)
    return tuple(_law(ELASTIC, each, time=each["time"], weight=each["weight"] / total) for each in blocks)


def solids_of(case: Mapping[str, Any], Ca_es: tuple[float, ...]) -> tuple[Solid | None, ...]:
    """The solids of a valid case with these Ca_e of its particles, None for rigid ones."""
    blocks = [block for _, block in solid_blocks(case)]
    blocks = blocks if len(blocks) == len(Ca_es) else blocks[:1] * len(Ca_es)
    return tuple(
        _law(solids.LAWS, block, Ca_e) if Ca_e > 0 else None for block, Ca_e in zip(blocks, Ca_es, strict=True)
    )


def slowest_of(case: Mapping[str, Any]) -> float:
    """The longest relaxation time of the liquid of a valid case over that of De."""
    return liquid_of({**case, "De": 1.0}).longest or 1.0


class Declared(NamedTuple):
    """A parameter of a law that a case names: its dotted key, declaration, and value, None if it is not given."""

    key: str
    parameter: Parameter
    value: Any


def declared_in(case: Mapping[str, Any]) -> Iterator[Declared]:
    """The parameters of the laws that a case names, which need not be validated yet."""
    block = liquid_block(case)
    modes = block["modes"] if isinstance(block.get("modes"), list | tuple) else ()
    places = [("liquid", block)]
    places += [(f"liquid.{part}", block_of(block[part])) for part in ("solvent", "yielding") if part in block]
    places += [(f"liquid.modes[{i}]", block_of(each)) for i, each in enumerate(modes)]
    places += solid_blocks(case)
    for place, each in places:
        law = LAWS.get(each["law"])
        for name, parameter in law.parameters().items() if law is not None else ():
            yield Declared(f"{place}.{name}", parameter, each.get(name))

"""The mistakes that pydantic finds in a file, with the keys of the file."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from pairsim.cases.material_keys import BLOCKS
from pairsim.cases.materials import liquid_block, solid_blocks
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.physical import BLOCK, stands_for
from pairsim.cases.quantities import QUANTITY
from pairsim.physics import liquids
from pairsim.physics.declared import PARAMETERS
from pairsim.physics.own_laws import OPTION
from pairsim.runtime.text import as_typed

CLOSE = 0.65  # least similarity (difflib) at which a key counts as a misspelling of another
BEYOND = re.compile(r"inertia|reynolds|^re$|gravity|off_?(axis|set)|eccentric|lateral|channel|wall|square")
"""Names of keys for what is not modelled."""
MODELLED = (
    "pairsim computes spheres on the axis of a round tube, without inertia and gravity (docs/explanation/limits.md)"
)
ADAPTED = {
    r"^Value error, ": "",
    r"^Input should be ": "must be ",
    r"^Field required": "must have more values",
    r"a valid tuple": "a list",
    r"a valid dictionary.*": "keys with their values",
    r"^Input tag .* does not match any of the expected tags: ": "must be one of ",
    r"^Unable to extract tag using discriminator 'law'": "must be the name of a law, or a group with law",
}
"""What replaces expressions of pydantic's."""


def groups_of(model: type[BaseModel]) -> dict[str, type[BaseModel]]:
    """The model of each group of keys, and of the top level under ""."""
    groups = {"": model}
    for name, field in model.model_fields.items():
        for kind in (field.annotation, *get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                groups[name] = kind
    return groups


def mistakes_of(error: ValidationError, model: type[BaseModel], data: Mapping[str, Any]) -> list[Mistake]:
    """The mistakes in a validation error of pydantic, one for each key.

    Args:
        error: The error.
        model: The model of the file.
        data: The keys and values that were validated.
    """
    problems: dict[str, list[Any]] = {}
    for problem in error.errors(include_url=False, include_context=False):
        problems.setdefault(_key(problem, data), []).append(problem)
    wrong_inside = {key[: place.start()] for key in problems for place in re.finditer(r"[.\[]", key)}
    return [_mistake(key, each, model, data) for key, each in problems.items() if key not in wrong_inside]


def _key(problem: Any, data: Mapping[str, Any]) -> str:
    """The dotted key of a problem; the names of alternatives, which pydantic has in its place, are not in the data."""
    key, place = "", problem["loc"]
    inner: Any = data
    for i, part in enumerate(place):
        if isinstance(part, int):
            if isinstance(inner, list | tuple) and part < len(inner):
                key, inner = f"{key}[{part}]", inner[part]
        elif isinstance(inner, Mapping) and part in inner:
            key, inner = f"{key}.{part}" if key else part, inner[part]
        elif problem["type"] == "missing" and i == len(place) - 1:
            key = f"{key}.{part}" if key else part
    return key


def _mistake(key: str, problems: list[Any], model: type[BaseModel], data: Mapping[str, Any]) -> Mistake:
    """The mistake of a key, of each of whose alternatives there is a problem."""
    value, kind = problems[0]["input"], problems[0]["type"]
    if kind == "missing" and isinstance(problems[0]["loc"][-1], str):
        group, _, name = key.rpartition(".")
        law = value.get("law") if group else None
        return missing(key, f"must be given with {group}: {{law: {law}, {name}: ...}}" if law else "must be given")
    if kind == "extra_forbidden":
        return Mistake(key, value, f"unknown key; {_hint(key, problems[0], model, data)}")
    allowed = ", or ".join(dict.fromkeys(_adapted(each["msg"]) for each in problems))
    if isinstance(value, str) and QUANTITY.fullmatch(value):
        stem = re.sub(r"\[\d+\]$", "", "d" if key.startswith("d0") else key)
        measured = [f"; with a unit it is {BLOCK}.{of.key}" for given, of in stands_for(data) if given == stem]
        return Mistake(key, value, allowed + "".join(measured[:1]))
    if kind == "union_tag_invalid":
        value, allowed = value["law"], f"{allowed}; {OPTION} FILE adds laws of your own"
    return Mistake(key, value, allowed)


def _adapted(text: str) -> str:
    for expression, other in ADAPTED.items():
        text = re.sub(expression, other, text)
    return text


def _hint(key: str, problem: Any, model: type[BaseModel], data: Mapping[str, Any]) -> str:
    """What an unknown key may have been meant to be, or which keys are allowed."""
    *place, name = problem["loc"]
    groups, group, value = groups_of(model), key.removesuffix(name).removesuffix("."), as_typed(problem["input"])
    block, _, last = name.rpartition(".")
    if key in PARAMETERS and "liquid" in model.model_fields:
        return _in_its_law(key, value, data)
    if block and block in groups and last in groups[block].model_fields:
        return f"write it in its group, as {block}: {{{last}: {value}}}"
    of = re.sub(r"\[\d+\]$", "", group).rpartition(".")[2]
    if of in BLOCKS:
        return f"allowed: {', '.join(BLOCKS[of][place[-1]].model_fields)}"
    if meant := _similar(name, group, groups):
        return f"did you mean {meant}?"
    if not group and BEYOND.search(name.lower()):
        return MODELLED
    return f"allowed: {', '.join(groups.get(group, model).model_fields)}"


def _in_its_law(key: str, value: str, data: Mapping[str, Any]) -> str:
    """How a parameter that is given beside its law is written in its block."""
    laws = PARAMETERS[key].laws
    place = "liquid" if laws[0] in liquids.LAWS else "solid"
    given = [block["law"] for _, block in [("liquid", liquid_block(data)), *solid_blocks(data)]]
    law = next((law for law in given if law in laws), laws[0])
    block = f"{place}: {{law: {law}, {key}: {value}}}"
    return f"it is a parameter of the law: write {block}; {place}.{key} in grids and after --set"


def _similar(name: str, group: str, groups: Mapping[str, type[BaseModel]]) -> str:
    """The known key most similar to an unknown one, preferably from the same group; "" if there is none."""
    leaves: dict[str, str] = {}
    for place in sorted(groups, key=lambda each: (each != group, each == BLOCK)):
        for field in groups[place].model_fields:
            leaves.setdefault(field.lower(), f"{place}.{field}" if place else field)
    close = difflib.get_close_matches(name.lower(), leaves, 2, CLOSE)
    # A quantity of another thing, such as bead_viscosity: either may be meant.
    alike = [each for each in close if "_" in name and each.endswith(name.lower().rpartition("_")[2])]
    return " or ".join(leaves[each] for each in (alike if len(alike) > 1 else close[:1]))

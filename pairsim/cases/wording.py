"""The messages of pydantic in the words of a case file."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from pairsim.cases.material_keys import BLOCKS, MODELS
from pairsim.cases.materials import liquid_block, solid_blocks
from pairsim.cases.mistakes import UNKNOWN, Mistake, missing
from pairsim.cases.physical import BLOCK, stands_for
from pairsim.cases.quantities import QUANTITY
from pairsim.physics import liquids
from pairsim.physics.declared import PARAMETERS
from pairsim.physics.own_laws import OPTION
from pairsim.runtime.text import as_typed

Groups = dict[str, type[BaseModel]]
CLOSE = 0.65  # least similarity (difflib) at which a key counts as a misspelling of another
BEYOND = re.compile(r"inertia|reynolds|^re$|gravity|off_?(axis|set)|eccentric|lateral|channel|wall|square")
"""Names of keys for what is not modelled."""
MODELLED = (
    "pairsim computes spheres on the axis of a round tube, without inertia and gravity (docs/explanation/limits.md)"
)
DECIMAL = "; numbers are written as 90, 0.4 or 1e-3, without quotes"
IN_PLAIN_WORDS = {
    r"^Value error, ": "",
    r"^Input should be ": "must be ",
    r"greater than or equal to": "at least",
    r"less than or equal to": "at most",
    r"greater than": "above",
    r"less than": "below",
    r"a valid dictionary.*": "keys with their values",
    r"a valid (tuple|list)": "a list",
    r"a valid integer": "a whole number",
    r"a valid boolean": "true or false",
    r"a valid string": "text",
    r"a valid number": "a number",
    r"^(Tuple|List|Dictionary) should have (.*) after validation, not (.*)": r"must have \2, not \3",
    r"^Field required": "must have more items",  # of a list: keys are said to be missing
}
"""Expressions of pydantic's, and what replaces them."""
UNDECIDED = "_type", "literal_error", "law"
"""Types of errors that each alternative has for a value of the type of another one."""


def groups_of(model: type[BaseModel]) -> Groups:
    """The model of each group of keys, and of the top level under ""."""
    groups: Groups = {"": model}
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
    # A key that takes alternatives, such as a number or a list, yields an error for each; the one that names an entry
    # of the list, or a key of the group, is more specific.
    detailed = {key[: place.start()] for key in problems for place in re.finditer(r"[.\[]", key)}
    found = [_mistake(key, each, groups_of(model), data) for key, each in problems.items() if key not in detailed]
    intended = {mistake.meant for mistake in found}
    return [each for each in found if not (each.is_missing and each.key in intended)]


def _key(problem: Any, data: Mapping[str, Any]) -> str:
    """The dotted key of a problem; the names of alternatives, which pydantic has in its place, are not in the data."""
    key, place = "", problem["loc"]
    inner: Any = data
    for i, part in enumerate(place):
        if isinstance(part, int):
            if isinstance(inner, list | tuple) and part < len(inner):
                key, inner = f"{key}[{part}]", inner[part]
        elif isinstance(inner, Mapping) and (part in inner or (problem["type"] == "missing" and i == len(place) - 1)):
            key, inner = f"{key}.{part}" if key else part, inner.get(part)
    return key


def _mistake(key: str, problems: list[Any], groups: Groups, data: Mapping[str, Any]) -> Mistake:
    """The mistake of a key, of each of whose alternatives there is a problem."""
    value, kind, place = problems[0]["input"], problems[0]["type"], problems[0]["loc"]
    if kind == "extra_forbidden":
        return _unknown(key, problems[0], groups, data)
    if kind == "missing" and isinstance(place[-1], str):
        group = key.rpartition(".")[0]
        return missing(key, f"must be given in {group}" if group else "must be given")
    # A value of the right type is wrong for the reason given for that one.
    decisive = [each for each in problems if not each["type"].endswith(UNDECIDED)] or problems
    first, *others = dict.fromkeys(_in_plain_words(each["msg"]) for each in decisive)
    allowed = ", or ".join([first, *(other.removeprefix("must be ") for other in others)])
    if isinstance(value, str) and QUANTITY.fullmatch(value):
        stem = re.sub(r"\[\d+\]$", "", "d" if key.startswith("d0") else key)
        if measured := next((of.key for given, of in stands_for(data) if given == stem), None):
            return Mistake(key, value, f"{allowed}; with a unit it is {BLOCK}.{measured}")
    if re.match(r"(liquid|solid)\b", key) and any(
        each["type"] in ("literal_error", "union_tag_invalid") for each in problems
    ):
        allowed += f"; {OPTION} FILE adds laws of your own"
    odd = "number" in allowed and isinstance(value, str) and re.match(r"[-+.]?\d", value)  # 1:30, 0,4
    return Mistake(key, value, allowed + DECIMAL if odd else allowed)


def _in_plain_words(text: str) -> str:
    for expression, plain in IN_PLAIN_WORDS.items():
        text = re.sub(expression, plain, text)
    return text


def _unknown(key: str, problem: Any, groups: Groups, data: Mapping[str, Any]) -> Mistake:
    """The mistake of an unknown key; suggests a similar key or lists the allowed ones."""
    *place, name = problem["loc"]
    value, group = problem["input"], key.removesuffix(name).removesuffix(".")
    block, _, last = name.rpartition(".")
    if key in PARAMETERS and "liquid" in groups[""].model_fields:
        meant, hint = _in_its_law(key, value, data)
    elif block in groups and last in groups[block].model_fields:
        meant, hint = name, f"write it in its group, as {block}: {{{last}: {as_typed(value)}}}"
    elif key.partition(".")[0].partition("[")[0] not in BLOCKS and (meant := _similar(name, group, groups)):
        hint = f"did you mean {meant}?"
    elif not group and BEYOND.search(name.lower()):
        meant, hint = "", MODELLED
    else:
        model = next((MODELS[part] for part in reversed(place) if part in MODELS), groups.get(group, groups[""]))
        meant, hint = "", f"allowed: {', '.join(model.model_fields)}"
    return Mistake(key, value, f"{UNKNOWN}{hint}", meant)


def _in_its_law(key: str, value: Any, data: Mapping[str, Any]) -> tuple[str, str]:
    """The dotted key of a parameter that is given beside its law, and how it is written there."""
    laws = PARAMETERS[key].laws
    place = "liquid" if laws[0] in liquids.LAWS else "solid"
    given = [block["law"] for _, block in [("liquid", liquid_block(data)), *solid_blocks(data)]]
    law = next((law for law in given if law in laws), laws[0])
    block = f"{place}: {{law: {law}, {key}: {as_typed(value)}}}"
    meant = f"{place}.{key}"
    return meant, f"it is a parameter of the law: write {block}; {meant} in grids and after --set"


def _similar(name: str, group: str, groups: Groups) -> str:
    """The known key most similar to an unknown one, preferably from the same group; "" if there is none."""
    leaves: dict[str, str] = {}
    for place in sorted(groups, key=lambda each: (each != group, each == BLOCK)):
        for field in groups[place].model_fields:
            leaves.setdefault(field.lower(), f"{place}.{field}" if place else field)
    close = difflib.get_close_matches(name.lower(), leaves, 2, CLOSE)
    # A quantity of another thing, such as bead_viscosity: either may be meant.
    alike = [each for each in close if "_" in name and each.endswith(name.lower().rpartition("_")[2])]
    return " or ".join(leaves[each] for each in (alike if len(alike) > 1 else close[:1]))

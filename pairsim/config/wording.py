"""Messages for validation errors of pydantic, and text for what each key allows."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from pairsim.config.material_keys import BLOCKS, LIQUIDS, MODELS
from pairsim.config.materials import liquid_block, solid_blocks
from pairsim.config.mistakes import UNKNOWN, Mistake, missing
from pairsim.config.physical import BLOCK, stands_for
from pairsim.config.quantities import QUANTITY
from pairsim.physics import liquids
from pairsim.physics.declared import PARAMETERS
from pairsim.runtime.text import as_typed

Groups = dict[str, type[BaseModel]]
CLOSE = 0.65  # least similarity (difflib) at which a key counts as a misspelling of another
BEYOND = re.compile(r"inertia|reynolds|^re$|gravity|off_?(axis|set)|eccentric|lateral|channel|wall|square")
"""Names of keys for what is not modelled."""
MODELLED = (
    "pairsim computes spheres on the axis of a round tube, without inertia and gravity (docs/explanation/limits.md)"
)
DECIMAL = "; numbers are written as 90, 0.4 or 1e-3, without quotes"
LIST = "a list, each entry "
NEEDED = {"De": "the four numbers of a case are beta, De, Ca_e and d0"}
KINDS = {
    "number": "a finite number",
    "integer": "a whole number",
    "boolean": "true or false",
    "string": "a word",
    "object": "keys with their values",
}
"""What a value must be, by its type in a JSON schema."""
LIMITS = {"exclusiveMinimum": "above", "minimum": "at least", "exclusiveMaximum": "below", "maximum": "at most"}


def groups_of(model: type[BaseModel]) -> Groups:
    """The model of each group of keys, and of the top level under ""."""
    groups: Groups = {"": model}
    for name, field in model.model_fields.items():
        for kind in (field.annotation, *get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                groups[name] = kind
    return groups


def dotted_keys(groups: Groups) -> list[str]:
    """All keys; those within a group as group.key."""
    return [
        f"{group}.{name}" if group else name
        for group, model in groups.items()
        for name in model.model_fields
        if group or name not in groups
    ]


def meant(name: str, group: str, groups: Groups) -> str:
    """The known key most similar to an unknown one, preferably from the same group; "" if there is none."""
    order = [group, *(other for other in groups if other not in (group, BLOCK)), BLOCK]
    keys = sorted(dotted_keys(groups), key=lambda key: order.index(key.rpartition(".")[0]))
    leaves = {key.rpartition(".")[2].lower(): key for key in reversed(keys)}
    close = difflib.get_close_matches(name.lower(), leaves, 2, CLOSE)
    # A quantity of another thing, such as bead_viscosity: either may be meant.
    alike = [each for each in close if "_" in name and each.endswith(name.lower().rpartition("_")[2])]
    return " or ".join(leaves[each] for each in (alike if len(alike) > 1 else close[:1]))


def _unknown(
    key: str, value: Any, group: str, model: type[BaseModel], groups: Groups, data: Mapping[str, Any]
) -> Mistake:
    """The mistake of an unknown key; suggests a similar key or lists the allowed ones."""
    name = key.removeprefix(f"{group}.")
    if key in PARAMETERS and "liquid" in groups[""].model_fields:
        laws = PARAMETERS[key].laws
        place = "liquid" if laws[0] in liquids.LAWS else "solid"
        given = [block["law"] for _, block in [("liquid", liquid_block(data)), *solid_blocks(data)]]
        law = next((law for law in given if law in laws), laws[0])
        block = f"{place}: {{law: {law}, {key}: {as_typed(value)}}}"
        allowed = f"{UNKNOWN}it is a parameter of the law: write {block}; {place}.{key} in grids and after --set"
        return Mistake(key, value, allowed, meant=f"{place}.{key}")
    if "." in name and key in dotted_keys(groups):
        place, _, last = key.rpartition(".")
        hint = f"write it in its group, as {place}: {{{last}: {as_typed(value)}}}"
        return Mistake(key, value, f"{UNKNOWN}{hint}", meant=key)
    if _first(key) not in BLOCKS and (hint := meant(name, group, groups)):
        return Mistake(key, value, f"{UNKNOWN}did you mean {hint}?", meant=hint)
    if not group and BEYOND.search(name.lower()):
        return Mistake(key, value, f"{UNKNOWN}{MODELLED}")
    return Mistake(key, value, f"{UNKNOWN}allowed: {', '.join(model.model_fields)}")


def mistakes_of(error: ValidationError, model: type[BaseModel], data: Mapping[str, Any]) -> list[Mistake]:
    """The mistakes in a validation error of pydantic, one for each key.

    Args:
        error: The error.
        model: The model of the file.
        data: The keys and values as given.
    """
    groups, found = groups_of(model), dict[str, Mistake]()
    if "liquid" in model.model_fields and (block := LIQUIDS.get(liquid_block(data)["law"])):
        groups["liquid"] = block  # whose keys may be meant
    for problem in error.errors(include_url=False, include_context=False):
        mistake = _mistake(problem, groups, data)
        found.setdefault(mistake.key, mistake)
    # A key that takes alternatives, such as a number or a list, yields an error for each; the one that names an entry
    # of the list, or a key of the group, is more specific.
    detailed = {key[: place.start()] for key in found for place in re.finditer(r"[.\[]", key)}
    intended = {mistake.meant for mistake in found.values()}
    return [m for key, m in found.items() if key not in detailed and not (m.is_missing and key in intended)]


def _mistake(problem: Any, groups: Groups, data: Mapping[str, Any]) -> Mistake:
    location, value, kind = problem["loc"], problem["input"], problem["type"]
    absent = kind == "missing" and isinstance(location[-1], str)  # and not an entry of a list that is too short
    key = _key(location, data, absent)
    if kind in ("range", "quantity"):
        return Mistake(key, value, problem["msg"])
    if kind == "model_type":
        return Mistake(key, value, f"must be a group of keys; allowed: {', '.join(groups[key].model_fields)}")
    group, model = _group(location, groups, data)
    name = key.removeprefix(f"{group}.")
    if kind == "extra_forbidden":
        return _unknown(key, value, group, model, groups, data)
    if absent:
        return missing(
            key, f"must be given in {group}" if group else NEEDED.get(key) or f"must be {allowed_in(model, name)}"
        )
    allowed = f"must be {allowed_in(model, _first(name), entry='[' in name)}"
    if isinstance(value, str) and QUANTITY.fullmatch(value):
        place = "d" if _first(key) == "d0" else re.sub(r"\[\d+\]$", "", key)
        if measured := next((of.key for given, of in stands_for(data) if given == place), None):
            return Mistake(key, value, f"{allowed}; with a unit it is {BLOCK}.{measured}")
    odd = "number" in allowed and isinstance(value, str) and re.match(r"[-+.]?\d", value)  # 010, 1:30, 0x10, 0,4
    return Mistake(key, value, allowed + DECIMAL if odd else allowed)


def _group(location: Sequence[str | int], groups: Groups, data: Mapping[str, Any]) -> tuple[str, type[BaseModel]]:
    """The innermost group of keys at a location, and its model: that of a block of a law, which is in the location."""
    last = max((i for i, part in enumerate(location) if part in MODELS), default=None)
    if last is not None:
        return _key(location[:last], data), MODELS[str(location[last])]
    group = str(location[0]) if len(location) > 1 and location[0] in groups.keys() - BLOCKS.keys() else ""
    return group, groups[group]


def _first(key: str) -> str:
    return re.split(r"[.\[]", key)[0]


def _key(location: Sequence[str | int], data: Mapping[str, Any], missing: bool = False) -> str:
    """The dotted key of a location; the names of alternatives, which pydantic has in it, are not in the data."""
    key = ""
    inner: Any = data
    for i, part in enumerate(location):
        if isinstance(part, int):
            if isinstance(inner, list | tuple) and part < len(inner):
                key, inner = f"{key}[{part}]", inner[part]
        elif isinstance(inner, Mapping) and (part in inner or (missing and i == len(location) - 1)):
            key, inner = f"{key}.{part}" if key else part, inner.get(part)
    return key


@cache
def _json_schema(model: type[BaseModel]) -> dict[str, Any]:
    return model.model_json_schema()


def allowed_in(model: type[BaseModel], name: str, entry: bool = False) -> str:
    """What a key (or, with `entry`, each entry of its list) allows, as text made from its JSON schema."""
    field = _json_schema(model)["properties"][name]
    if not entry:
        return _words(field)
    values = [choice.get("additionalProperties", choice) for choice in field.get("anyOf", [field])]
    items = [each["items"] for value in values for each in value.get("anyOf", [value]) if "items" in each]
    return joined(map(_words, items)) if items else _words(field)


def joined(choices: Iterable[str]) -> str:
    """Join alternatives without repetition; a list of another alternative becomes "a list of these"."""
    each = list(dict.fromkeys(choices))
    texts = ["a list of these" if c.startswith(LIST) and c.removeprefix(LIST) in each else c for c in each]
    return ", or ".join(texts)


def _words(schema: Mapping[str, Any]) -> str:
    """What a part of a JSON schema allows, as text."""
    kind = KINDS.get(str(schema.get("type")), "a value")
    if "words" in schema:
        return str(schema["words"])
    if "const" in schema or "enum" in schema:
        *others, last = map(str, schema.get("enum", [schema.get("const")]))
        return f"{', '.join(others)} or {last}" if others else last
    if "oneOf" in schema:
        return "a group with law and its parameters"
    if "anyOf" in schema:
        return joined(_words(each) for each in schema["anyOf"] if each.get("type") != "null")
    if isinstance(values := schema.get("additionalProperties"), dict):
        return f"a key with {_words(values)}"
    if "prefixItems" in schema:
        return f"two numbers, each {_words(schema['prefixItems'][0])}"
    if schema.get("type") == "array":
        return f"{LIST}{_words(schema['items'])}"
    limits = " and ".join(f"{word} {schema[limit]:g}" for limit, word in LIMITS.items() if limit in schema)
    return f"{kind} {limits}".strip()

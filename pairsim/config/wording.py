"""Messages for validation errors of pydantic, and text for what each key allows."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from pairsim.config.material_keys import models_in
from pairsim.config.mistakes import UNKNOWN, Mistake, missing
from pairsim.config.physical import BLOCK
from pairsim.runtime.text import as_typed

Groups = dict[str, type[BaseModel]]
LIST = "a list, each entry "
MOST_OF_A_KEY = 10  # mistakes of one key that are read
LONGEST_KEY = 100  # characters of a key up to which a similar one is looked for
LONGEST_NUMBER = 40  # characters of a text that is read as a number, for a hint
CLOSE = 0.65  # least similarity (difflib) at which a key counts as a misspelling of another


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
    if len(name) > LONGEST_KEY:
        return ""
    keys = sorted(dotted_keys(groups), key=lambda key: key.startswith(f"{BLOCK}."))  # keys of the physical block last
    own = [key for key in keys if key.rpartition(".")[0] == group]
    for wanted in (own, keys):
        if same := [key for key in wanted if key.rpartition(".")[2].lower() == name.lower()]:
            return same[0]
    if not group and name in groups:
        return name
    for wanted in (own, keys):
        leaves = {key.rpartition(".")[2]: key for key in reversed(wanted)}
        if close := difflib.get_close_matches(name, leaves, 1, CLOSE):
            return leaves[close[0]]
    return ""


def unknown_key(key: str, value: Any, groups: Groups) -> Mistake:
    """The mistake of an unknown key; suggests a similar key or lists the allowed ones."""
    group, _, name = key.rpartition(".")
    if key in dotted_keys(groups):
        return Mistake(
            key, value, f"{UNKNOWN}write it in its group, as {group}: {{{name}: {as_typed(value)}}}", meant=key
        )
    of_law = re.split(r"[.\[]", key)[0] in ("liquid", "solid")
    if hint := "" if of_law else meant(name, group, groups):
        return Mistake(key, value, f"{UNKNOWN}did you mean {hint}?", meant=hint)
    known = groups.get(group, groups[""]).model_fields
    return Mistake(key, value, f"{UNKNOWN}allowed: {', '.join(known)}")


def mistakes_of(error: ValidationError, groups: Groups, data: Mapping[str, Any]) -> list[Mistake]:
    """The mistakes in a validation error of pydantic, one for each key.

    Args:
        error: The error.
        groups: The models of the file.
        data: The keys and values as given.
    """
    groups = groups | (models_in(data) if "liquid" in groups[""].model_fields else {})
    found: dict[str, Mistake] = {}
    seen: Counter[Any] = Counter()
    for problem in error.errors(include_url=False, include_context=False):
        within = problem["loc"][: 2 if problem["loc"][:1] and problem["loc"][0] in groups else 1]
        seen[within] += 1
        if seen[within] > MOST_OF_A_KEY:  # the entries of a long list
            continue
        mistake = _mistake(problem, groups, data)
        found.setdefault(mistake.key, mistake)
    # A key that takes alternatives, such as a number or a list, yields an error for each; the one that names an entry
    # of the list, or a key of the group, is more specific.
    detailed = {key[: place.start()] for key in found for place in re.finditer(r"[.\[]", key)}
    intended = {mistake.meant for mistake in found.values()}
    return [m for key, m in found.items() if key not in detailed and not (m.is_missing and key in intended)]


def _mistake(problem: Any, groups: Groups, data: Mapping[str, Any]) -> Mistake:
    value, kind = problem.get("input"), problem["type"]
    key = _key(problem["loc"], data, missing=kind == "missing")
    within = key if kind == "model_type" else key.rpartition(".")[0]
    group = max((group for group in groups if f"{within}.".startswith(f"{group}.")), key=len, default="")
    name = key.removeprefix(f"{group}.") if group else key
    value = list(value) if isinstance(value, tuple) else value
    if kind == "extra_forbidden":
        return unknown_key(key, value, groups)
    if kind == "missing":
        return missing(key, _needed(group, name, groups))
    if kind in ("range", "quantity"):
        return Mistake(key, value, problem["msg"])
    if kind == "model_type":
        return Mistake(key, value, f"must be a group of keys; allowed: {', '.join(groups[group].model_fields)}")
    field = re.split(r"[.\[]", name)[0]
    allowed = f"must be {allowed_in(groups[group], field, entry='[' in name)}"
    return Mistake(key, value, allowed + (_decimal(value) if "number" in allowed else ""))


def _decimal(value: Any) -> str:
    """How to write a text that looks like a number, such as 010 or 1:30, in decimal; empty if it is none."""
    text = value if isinstance(value, str) and len(value) <= LONGEST_NUMBER else ""
    if re.fullmatch(r"[-+]?0\d+", text):
        octal = f", or as {int(text, 8)} if it is octal" if not set("89") & set(text) else ""
        return f"; write it as {int(text)}{octal}"
    if re.fullmatch(r"[-+]?0[xob][0-9a-fA-F]+", text):
        try:
            return f"; write it as {int(text, 0)}"
        except ValueError:
            return ""
    if re.fullmatch(r"[-+]?\d+(:[0-5]?\d)+(\.\d*)?", text):
        whole, *parts = text.split(":")
        seconds = abs(int(whole))
        for part in parts[:-1]:
            seconds = 60 * seconds + int(part)
        return f"; write it as {60 * seconds + float(parts[-1]):g} if it is in base 60 (minutes:seconds)"
    if re.fullmatch(r"[-+]?\d+(_\d+)+", text):
        return f"; write it as {text.replace('_', '')}"
    return f"; write it as {text.replace(',', '.')}" if re.fullmatch(r"[-+]?\d+,\d+", text) else ""


def _key(location: Sequence[str | int], data: Mapping[str, Any], missing: bool) -> str:
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


def _needed(group: str, name: str, groups: Groups) -> str:
    if group:
        return f"must be given in {group}"
    if BLOCK in groups:
        return "the four numbers of a case are beta, De, Ca_e and d0"
    return f"must be {allowed_in(groups[''], name)}"


@cache
def _json_schema(model: type[BaseModel]) -> dict[str, Any]:
    return model.model_json_schema()


def allowed_in(model: type[BaseModel], name: str, entry: bool = False) -> str:
    """What a key (or, with `entry`, each entry of its list) allows, as text made from its JSON schema."""
    schema = _json_schema(model)
    field = schema["properties"][name]
    if "words" in field and not entry:
        return str(field["words"])
    choices = [choice for choice in field.get("anyOf", [field]) if choice.get("type") != "null"]
    if entry:
        values = [choice.get("additionalProperties", choice) for choice in choices]
        listed = [inner for value in values for inner in value.get("anyOf", [value]) if "items" in inner]
        choices = [inner["items"] for inner in listed] or choices
    return joined(_words(choice, schema.get("$defs", {})) for choice in choices)


def joined(choices: Iterable[str]) -> str:
    """Join alternatives without repetition; a list of another alternative becomes "a list of these"."""
    each = list(dict.fromkeys(choices))
    texts = ["a list of these" if c.startswith(LIST) and c.removeprefix(LIST) in each else c for c in each]
    return ", or ".join(texts)


def _words(schema: Mapping[str, Any], models: Mapping[str, Any]) -> str:
    if "words" in schema:
        return str(schema["words"])
    limits = [
        f"{word} {schema[k]:g}"
        for k, word in (
            ("exclusiveMinimum", "above"),
            ("minimum", "at least"),
            ("exclusiveMaximum", "below"),
            ("maximum", "at most"),
        )
        if k in schema
    ]
    kinds = {"number": "a finite number", "integer": "a whole number", "boolean": "true or false", "string": "a word"}
    if "$ref" in schema:
        return f"a group of keys: {', '.join(models[schema['$ref'].rpartition('/')[2]]['properties'])}"
    if "const" in schema:
        return str(schema["const"])
    if "enum" in schema:
        *others, last = map(str, schema["enum"])
        return f"{', '.join(others)} or {last}" if others else last
    if "oneOf" in schema:
        return "a group with law and its parameters"
    if "anyOf" in schema:
        return joined(_words(s, models) for s in schema["anyOf"])
    if schema.get("type") == "object":
        values = schema.get("additionalProperties")
        return f"a key with {_words(values, models)}" if isinstance(values, dict) else "keys with their values"
    if "prefixItems" in schema:
        return f"two numbers, each {_words(schema['prefixItems'][0], models)}"
    if schema.get("type") == "array":
        return f"{LIST}{_words(schema['items'], models)}"
    text = kinds.get(str(schema.get("type")), "a value")
    return f"{text} {' and '.join(limits)}".strip() if limits else text

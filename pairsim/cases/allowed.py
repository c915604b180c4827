"""The values that a key allows, in words made from the JSON schema of its model."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING

from pydantic import BaseModel

from pairsim.cases.values import MOST_VALUES

if TYPE_CHECKING:
    from pydantic.json_schema import JsonSchemaValue

KINDS = {
    "number": "number",
    "integer": "whole number",
    "boolean": "true or false",
    "string": "text",
    "object": "keys with their values",
}
"""The types of a JSON schema in words."""
LIMITS = {"exclusiveMinimum": "above", "minimum": "of at least", "exclusiveMaximum": "below", "maximum": "at most"}
LAW = "a group with the law and its parameters"
SEVERAL = {"number": "numbers", "whole number": "whole numbers", "keys": "groups of keys", "a group": "groups"}
"""The plurals of words with which the values in a list begin."""


def allowed_in(model: type[BaseModel], name: str) -> str:
    """The values that a key allows, in words made from its JSON schema."""
    return _words(_json_schema(model)["properties"][name])


@cache
def _json_schema(model: type[BaseModel]) -> JsonSchemaValue:
    return model.model_json_schema()


def _words(schema: JsonSchemaValue) -> str:
    """The values that a part of a JSON schema allows, in words."""
    if "enum" in schema or "const" in schema:
        return ", ".join(map(str, schema.get("enum", [schema.get("const")])))
    if "$ref" in schema or "discriminator" in schema:
        return "{start, stop, num, spacing}" if "Range" in str(schema) else LAW
    example = f"such as {' or '.join(map(str, schema['examples']))}" if "examples" in schema else ""
    if alternatives := schema.get("anyOf", schema.get("oneOf")):
        each = dict.fromkeys(_words(one) for one in alternatives if one.get("type") != "null")
        texts = ", or ".join(text.replace(f"list of {_several(next(iter(each)))}", "a list of these") for text in each)
        return " ".join(filter(None, (", or ".join(dict.fromkeys(texts.split(", or "))), example)))
    if schema.get("type") == "array":
        least, most = schema.get("minItems", 0), schema.get("maxItems", MOST_VALUES)
        count = f"{least}{'' if most == least else f' to {most}' if most < MOST_VALUES else ' or more'} "
        inner = _several(_words(schema.get("items", schema.get("prefixItems", [{}])[0])))
        return f"list of {count if least > 1 else ''}{inner}{example and ', '}{example}"
    if "minimum" in schema and schema["minimum"] == schema.get("maximum"):
        return f"{schema['minimum']:g}"
    limits = " and ".join(f"{word} {schema[limit]:g}" for limit, word in LIMITS.items() if limit in schema)
    if "minimum" in schema and "maximum" in schema:
        limits = f"from {schema['minimum']:g} to {schema['maximum']:g}"
    return " ".join(filter(None, (KINDS.get(str(schema.get("type")), "value"), limits, example)))


def _several(words: str) -> str:
    """The words for one value of a list as those for all its values."""
    one = next((one for one in sorted(SEVERAL, key=len, reverse=True) if re.match(rf"{one}\b", words)), "")
    return SEVERAL.get(one, "") + words.removeprefix(one)

"""The keys of each kind of file, as rows of a table and as a JSON Schema."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

from pairsim.cases.allowed import allowed_in
from pairsim.cases.keys import groups_of
from pairsim.cases.material_keys import BLOCKS


def schema_rows(model: type[BaseModel]) -> list[tuple[str, str, str, str]]:
    """Key, allowed values, default and description of every key in a file."""
    rows = []
    groups = groups_of(model)
    for group, of_group in groups.items():
        for name in of_group.model_fields:
            if not group and name in groups:
                continue
            rows.append(_row(of_group, name, group))
            if not group:
                rows += _rows_of_laws(name, BLOCKS.get(name, {}))
    return rows


def _row(model: type[BaseModel], name: str, group: str) -> tuple[str, str, str, str]:
    field, key = model.model_fields[name], f"{group}.{name}" if group else name
    default = f"required{f' in {group}' if group else ''}" if field.is_required() else _text(field.default)
    return key, allowed_in(model, name), default, field.description or ""


def _rows_of_laws(key: str, models: Mapping[str, type[BaseModel]]) -> list[tuple[str, str, str, str]]:
    """The rows of the keys in the blocks of some laws; a key of several laws has one row."""
    found: dict[tuple[str, str, str, str], list[str]] = {}
    for law, model in models.items():
        for name in (name for name in model.model_fields if name != "law"):
            found.setdefault(_row(model, name, key), []).append(law)
    return [(*row[:3], f"{row[3]} ({', '.join(laws)})") for row, laws in found.items()]


def _text(value: Any) -> str:
    """A value as it would be written in a file; empty if it is not set."""
    if value is None or value == () or value == [] or value == {}:
        return ""
    return value if isinstance(value, str) else json.dumps(value, default=str)


class _Alternatives(GenerateJsonSchema):
    """Allows values that fit several alternatives: the list [0.1, 0.4] of d is two distances, or those of two gaps."""

    def tagged_union_schema(self, schema: Any) -> JsonSchemaValue:
        return {"anyOf": super().tagged_union_schema(schema)["oneOf"]}


def json_schema(command: str, model: type[BaseModel]) -> str:
    """The JSON Schema for the file of a command."""
    schema = model.model_json_schema(schema_generator=_Alternatives)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return json.dumps({**head, **schema, "title": f"pairsim {command}"}, indent=2)

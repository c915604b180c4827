"""The keys of each kind of file, as rows of a table and as a JSON Schema."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from pairsim.cases.material_keys import BLOCKS
from pairsim.cases.messages import groups_of
from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import model_of, read_case
from pairsim.runtime.errors import InputError

LIST = "a list, each entry "
KINDS = {
    "number": "a finite number",
    "integer": "a whole number",
    "boolean": "true or false",
    "string": "a word",
    "object": "keys with their values",
}
"""What a value must be, by its type in a JSON schema."""
LIMITS = {"exclusiveMinimum": "above", "minimum": "at least", "exclusiveMaximum": "below", "maximum": "at most"}


def schema_rows(command: str = "run") -> list[tuple[str, str, str, str]]:
    """Key, allowed values, default and description of every key in the file of a command."""
    rows = []
    groups = groups_of(model_of(command))
    for group, model in groups.items():
        for name, field in model.model_fields.items():
            if not group and name in groups:
                continue
            key = f"{group}.{name}" if group else name
            default = f"required{f' in {group}' if group else ''}" if field.is_required() else _text(field.default)
            rows.append((key, _allowed_in(model, name), default, field.description or ""))
            if not group:
                rows += _rows_of_laws(key, BLOCKS.get(key, {}))
    return rows


def _rows_of_laws(key: str, models: Mapping[str, type[BaseModel]]) -> list[tuple[str, str, str, str]]:
    """The rows of the keys in the blocks of some laws; a key of several laws has one row."""
    found: dict[tuple[str, str, str, str], list[str]] = {}
    for law, model in models.items():
        for name, field in model.model_fields.items():
            if name != "law":
                default = f"required in {key}" if field.is_required() else _text(field.default)
                row = f"{key}.{name}", _allowed_in(model, name), default, field.description or ""
                found.setdefault(row, []).append(law)
    return [(*row[:3], f"{row[3]} ({', '.join(laws)})") for row, laws in found.items()]


def values_in(command: str, path: Path, settings: tuple[str, ...]) -> dict[str, str]:
    """The value of each key in a case, defaults included.

    Args:
        command: The command that reads the file, one for a single case.
        path: The case file.
        settings: key=value settings that replace keys.

    Returns:
        Values as text, by dotted key.

    Raises:
        InputError: The case is invalid, or the command is another one.
    """
    if command not in QUESTIONS:
        raise InputError(
            "pairsim schema", "--case", command, f"must be left out, or be used with {', '.join(QUESTIONS)}"
        )
    resolved = read_case(QUESTIONS[command], path, settings).resolved()
    values: dict[str, str] = {}
    for key, value in resolved.items():
        inner = value if isinstance(value, Mapping) and key in groups_of(model_of(command)) else {"": value}
        if key in BLOCKS and isinstance(value, Mapping):
            inner = {"": value, **value}
        values |= {f"{key}.{name}" if name else key: _text(entry) for name, entry in inner.items()}
    return values


def _text(value: Any) -> str:
    """A value as it would be written in a file; empty if it is not set."""
    if value is None or value == () or value == [] or value == {}:
        return ""
    return value if isinstance(value, str) else json.dumps(value, default=str)


def json_schema(command: str) -> str:
    """The JSON Schema for the file of a command."""
    schema = model_of(command).model_json_schema()
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": f"pairsim {command}"}
    return json.dumps(_plain(schema), indent=2)


def _plain(schema: Any) -> Any:
    """A copy without the entries `words`, which are only used in messages."""
    if isinstance(schema, Mapping):
        return {key: _plain(value) for key, value in schema.items() if key != "words" or not isinstance(value, str)}
    return list(map(_plain, schema)) if isinstance(schema, list) else schema


def _allowed_in(model: type[BaseModel], name: str) -> str:
    """What a key allows, as text made from its JSON schema."""
    return _words(_json_schema(model)["properties"][name])


@cache
def _json_schema(model: type[BaseModel]) -> dict[str, Any]:
    return model.model_json_schema()


def _joined(choices: Iterable[str]) -> str:
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
        return _joined(_words(each) for each in schema["anyOf"] if each.get("type") != "null")
    if isinstance(values := schema.get("additionalProperties"), dict):
        return f"a key with {_words(values)}"
    if "prefixItems" in schema:
        return f"two numbers, each {_words(schema['prefixItems'][0])}"
    if schema.get("type") == "array":
        return f"{LIST}{_words(schema['items'])}"
    limits = " and ".join(f"{word} {schema[limit]:g}" for limit, word in LIMITS.items() if limit in schema)
    return f"{kind} {limits}".strip()

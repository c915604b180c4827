"""Case files: YAML in, a checked case out, and errors in the words of the file."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ValidationError

from pairsim.config.case import Case, SceneCase, check_together
from pairsim.config.cost import check_size
from pairsim.config.curve_case import CriticalCase, CurveCase, check_critical, check_curve
from pairsim.runtime.errors import InputError


class _Loader(yaml.SafeLoader):
    """YAML in which 1e-3 is a number and a repeated key is an error."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str):
                raise yaml.constructor.ConstructorError(None, None, f"key {key!r} is not a word", key_node.start_mark)
            if key in seen:
                raise yaml.constructor.ConstructorError(None, None, f"key {key!r} is given twice", key_node.start_mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"), list("-+0123456789.")
)


def read_yaml(path: Path) -> dict[str, Any]:
    """A YAML file whose top level is a mapping.

    Raises:
        InputError: It is missing, unreadable, broken, or something else.
    """
    name = str(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(name, "", None, "no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(name, "", None, f"cannot be read: {error}") from None
    try:
        data = yaml.load(text, _Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}" if mark else "?"
        raise InputError(name, where, None, f"not valid YAML: {error.problem}") from None
    except yaml.YAMLError as error:
        raise InputError(name, "", None, f"not valid YAML: {error}") from None
    except ValueError as error:  # a date or a number that is none, such as 2020-13-45
        raise InputError(name, "", None, f"holds a value that cannot be read: {error}") from None
    if not isinstance(data, dict):
        raise InputError(name, "", None, "the file must hold keys and values, such as beta: 0.4; see pairsim schema")
    return data


def load_case(path: Path, overrides: tuple[str, ...] = ()) -> Case:
    """Read and check the file of a case in time.

    Args:
        path: The file.
        overrides: key=value settings (dotted keys) that replace or add to what the file says.

    Raises:
        InputError: With file, key, value and what is allowed.
    """
    return case_from_dict(read_with(path, overrides), str(path))


def load_curve(path: Path, overrides: tuple[str, ...] = ()) -> CurveCase:
    """Read and check the file of a master curve; as `load_case`."""
    return curve_from_dict(read_with(path, overrides), str(path))


def load_critical(path: Path, overrides: tuple[str, ...] = ()) -> CriticalCase:
    """Read and check the file of a search for critical distances; as `load_case`."""
    return critical_from_dict(read_with(path, overrides), str(path))


def read_with(path: Path, overrides: tuple[str, ...]) -> dict[str, Any]:
    """A case file's content with key=value settings put in.

    Raises:
        InputError: The file cannot be read or a setting is not understood.
    """
    data = read_yaml(path)
    apply_settings(data, overrides)
    return data


def apply_settings(data: dict[str, Any], overrides: tuple[str, ...]) -> None:
    """Replace or add keys of plain data, in place.

    Args:
        data: Keys and values, groups nested.
        overrides: key=value settings (dotted keys), as given to --set.

    Raises:
        InputError: A setting is not key=value, or its key goes through something that is no group.
    """
    for setting in overrides:
        key, equals, text = setting.partition("=")
        if not equals or not key:
            raise InputError("--set", "", setting, "key=value, such as mesh.Np=20")
        try:
            value = yaml.load(text, _Loader)
        except (yaml.YAMLError, ValueError):
            raise InputError("--set", key, text, "a YAML value") from None
        *groups, last = key.split(".")
        target = data
        for group in groups:
            target = target.setdefault(group, {})
            if not isinstance(target, dict):
                raise InputError("--set", key, text, f"{group} is not a group of keys")
        target[last] = value


def case_from_dict(data: Mapping[str, Any], source: str) -> Case:
    """Check plain data.

    Raises:
        InputError: With the first wrong key, its value and what is allowed.
    """
    case = _validated(Case, data, source)
    check_together(case, source)
    check_size(case, source)
    return case


def curve_from_dict(data: Mapping[str, Any], source: str) -> CurveCase:
    """Check plain data; as `case_from_dict`."""
    case = _validated(CurveCase, data, source)
    check_curve(case, source)
    check_size(case, source)
    return case


def critical_from_dict(data: Mapping[str, Any], source: str) -> CriticalCase:
    """Check plain data; as `case_from_dict`."""
    case = _validated(CriticalCase, data, source)
    check_critical(case, source)
    check_size(case, source)
    return case


def _validated[T: SceneCase](model: type[T], data: Mapping[str, Any], source: str) -> T:
    try:
        return model.model_validate(_tuples(data))
    except ValidationError as error:
        raise _input_error(error, source, _groups(model)) from None


def _tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _tuples(v) for k, v in value.items()}
    return tuple(value) if isinstance(value, list) else value


Groups = dict[str, type[BaseModel]]


def _groups(model: type[SceneCase]) -> Groups:
    """The model itself under "", and its groups of keys."""
    fields = {name: field.annotation for name, field in model.model_fields.items()}
    return {"": model} | {k: v for k, v in fields.items() if isinstance(v, type) and issubclass(v, BaseModel)}


def _names_an_entry(problem: Any) -> bool:
    return any(isinstance(part, int) for part in problem["loc"])


def _input_error(error: ValidationError, source: str, groups: Groups) -> InputError:
    """The first problem that pydantic met, in the words of the case file."""
    errors = error.errors()
    # A key that takes a number or a list fails twice; the entry of the list says more.
    first = max((e for e in errors if e["loc"][:1] == errors[0]["loc"][:1]), key=_names_an_entry)
    location = [str(part) for part in first["loc"]]
    group = location[0] if location and location[0] in groups else ""
    depth = 2 if group and len(location) > 1 else 1
    key = ".".join(location[:depth])
    indices = [part for part in location[depth:] if part.isdigit()]
    key += "".join(f"[{i}]" for i in indices)
    value = first.get("input")
    if isinstance(value, tuple):
        value = list(value)
    kind = first["type"]
    if kind == "extra_forbidden":
        known = list(groups[group].model_fields)
        near = difflib.get_close_matches(location[-1], known, 1, 0.5)
        hint = f"did you mean {near[0]}? " if near else ""
        return InputError(source, key, value, f"unknown key; {hint}allowed: {', '.join(known)}")
    if kind == "missing":
        return InputError(source, key, None, "is missing; the four numbers of a case are beta, De, Ca_e and d0")
    if kind == "range":
        return InputError(source, key, value, first["msg"])
    if kind == "model_type":
        known = list(groups[group].model_fields)
        return InputError(source, key, value, f"a group of keys; allowed: {', '.join(known)}")
    name = location[depth - 1]
    return InputError(source, key, value, _allowed(groups[group], name))


def _allowed(model: type[BaseModel], name: str) -> str:
    """What a key accepts, in words, from its own JSON schema."""
    schema = model.model_json_schema()
    field = schema["properties"][name]
    return "; or ".join(_words(s) for s in field.get("anyOf", [field]) if s.get("type") != "null")


def _words(schema: Mapping[str, Any]) -> str:
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
    if "const" in schema:
        return str(schema["const"])
    if "enum" in schema:
        return " or ".join(map(str, schema["enum"]))
    if "anyOf" in schema:
        return "; or ".join(_words(s) for s in schema["anyOf"])
    if schema.get("type") == "object":
        return "a name with " + _words(schema["additionalProperties"])
    if "prefixItems" in schema:
        return f"two numbers, each {_words(schema['prefixItems'][0])}"
    if schema.get("type") == "array":
        return f"a list of which each is {_words(schema['items'])}"
    text = kinds.get(str(schema.get("type")), "a value")
    if "pattern" in schema:
        text += " of at most 100 letters, digits and . _ + -, not beginning with one of . + -"
    return f"{text} {' and '.join(limits)}".strip() if limits else text


MODELS: dict[str, type[SceneCase]] = {"run": Case, "curve": CurveCase, "critical": CriticalCase}
"""What the case file of each command is checked against."""


def schema_rows(command: str = "run") -> list[tuple[str, str, str, str]]:
    """Key, what is allowed, default and description of every key of a command's case file."""
    rows = []
    groups = _groups(MODELS[command])
    for group, model in groups.items():
        for name, field in model.model_fields.items():
            if not group and name in groups:
                continue
            key = f"{group}.{name}" if group else name
            default = "required" if field.is_required() else field.default
            default = (
                "" if default in (None, ()) else str(default).lower() if default in (True, False) else str(default)
            )
            rows.append((key, _allowed(model, name), default, field.description or ""))
    return rows

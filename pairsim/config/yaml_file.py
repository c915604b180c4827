"""Read YAML files, keeping the file and line of each key for error messages."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from pairsim.runtime.errors import InputError

OPTION = "--set"
MERGE = "tag:yaml.org,2002:merge"  # of the key <<


class Place(NamedTuple):
    """Where a key was given: the file, or `--set`, and the line, None for `--set`."""

    file: str
    line: int | None


class Section(dict[str, Any]):
    """Keys and values of a file or of a group in it.

    Attributes:
        places: Where each key was given, if known.
    """

    def __init__(self, values: Mapping[str, Any] | None = None, places: Mapping[str, Place] | None = None) -> None:
        super().__init__(values or {})
        self.places = dict(places or {})

    def put(self, key: str, value: Any, place: Place | None) -> None:
        """Set a key and its place."""
        self[key] = value
        self.places.pop(key, None)
        if place is not None:
            self.places[key] = place

    def group(self, key: str) -> Any:
        """The value of a key; an empty group is added if the key is not there."""
        return self.setdefault(key, Section())


yaml.SafeDumper.add_representer(Section, yaml.SafeDumper.represent_dict)


def places_in(data: Mapping[str, Any]) -> Mapping[str, Place]:
    """Where the keys of a group were given, as far as that is known."""
    return data.places if isinstance(data, Section) else {}


def place_of(data: Mapping[str, Any], key: str) -> Place | None:
    """Where a dotted key, such as mesh.Np or cases[1].mesh.Np, was given.

    If it is missing, the place of what it would be in; None if that is unknown.
    """
    place = None
    inner: Any = data
    rest = key
    while rest:
        index = re.match(r"\[(\d+)\]\.?", rest)
        if index is not None:
            rest = rest[index.end() :]
            if isinstance(inner, list | tuple) and int(index[1]) < len(inner):
                inner = inner[int(index[1])]
                place = _start(inner) or place
        elif not isinstance(inner, Section):
            break
        else:
            # A key may contain points, such as mesh.Np of a grid, and an unknown key anything.
            names = (rest, rest.partition("[")[0], re.split(r"[.\[]", rest)[0])
            name = next((name for name in names if name in inner.places), names[-1])
            place = inner.places.get(name, place)
            inner = inner.get(name)
            rest = rest[max(len(name), 1) :].removeprefix(".")
    return place


def _start(value: Any) -> Place | None:
    """Place of the first key of a group."""
    return next(iter(places_in(value).values()), None) if isinstance(value, Section) else None


def _construct(loader: yaml.SafeLoader, node: yaml.MappingNode) -> Section:
    """Construct a mapping. Keys must be strings and occur once; they may override keys merged with <<.

    Raises:
        yaml.constructor.ConstructorError: A key is not a string or occurs twice.
    """
    seen: set[str] = set()
    for key_node, _ in node.value:
        if key_node.tag == MERGE:
            continue
        key = loader.construct_object(key_node, deep=True)
        if not isinstance(key, str):
            raise yaml.constructor.ConstructorError(None, None, f"key {key!r} must be text", key_node.start_mark)
        if key in seen:
            raise yaml.constructor.ConstructorError(
                None, None, f"key {key!r} must be given only once", key_node.start_mark
            )
        seen.add(key)
    loader.flatten_mapping(node)
    section = Section()
    for key_node, value_node in node.value:
        place = Place(str(loader.name), key_node.start_mark.line + 1)
        section.put(loader.construct_object(key_node, deep=True), loader.construct_object(value_node, deep=True), place)
    return section


class _Loader(yaml.SafeLoader):
    """YAML in which 1e-3 is a number and a repeated key is an error."""


_Loader.add_constructor("tag:yaml.org,2002:map", _construct)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"), list("-+0123456789.")
)


def _parse(text: str, name: str) -> Any:
    """Parse a YAML text; `name` is the file in the places of its keys."""
    loader = _Loader(text)
    loader.name = name
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()


def read_yaml(path: Path) -> Section:
    """Read a YAML file whose top level is a mapping.

    Raises:
        InputError: The file is missing, unreadable, not valid YAML, or its top level is not a mapping.
    """
    name = str(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(name, "", None, "no such file") from None
    except IsADirectoryError:
        raise InputError(name, "", None, "must be a file, but is a folder") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(name, "", None, f"cannot be read: {error}") from None
    try:
        data = _parse(text, name)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        raise InputError(name, "", None, f"must be valid YAML: {error.problem}", line=line) from None
    except yaml.YAMLError as error:
        raise InputError(name, "", None, f"must be valid YAML: {error}") from None
    except ValueError as error:  # an invalid date, such as 2020-13-45
        raise InputError(name, "", None, f"must be valid YAML: {error}") from None
    if not isinstance(data, Section):
        raise InputError(name, "", None, "must contain keys and values, such as beta: 0.4; see pairsim schema")
    return data


def apply_settings(data: Section, overrides: tuple[str, ...]) -> None:
    """Apply key=value settings to keys and values, in place.

    Args:
        data: Keys and values, groups nested.
        overrides: Settings key=value with dotted keys, as given to --set.

    Raises:
        InputError: A setting is not of the form key=value, or its key goes through a value that is not a group.
    """
    for setting in overrides:
        key, equals, text = setting.partition("=")
        if not equals or not key:
            raise InputError(OPTION, "", setting, "must be key=value, such as mesh.Np=20")
        try:
            value = _parse(text, OPTION)
        except (yaml.YAMLError, ValueError):
            raise InputError(OPTION, key, text, "must be a valid YAML value") from None
        *groups, last = key.split(".")
        target = data
        for group in groups:
            target = target.group(group)
            if not isinstance(target, Section):
                raise InputError(OPTION, key, text, f"must be a key within a group, but {group} is not a group of keys")
        target.put(last, value, Place(OPTION, None))

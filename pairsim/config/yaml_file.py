"""Read YAML files, keeping the file and line of each key for error messages.

A file is data: it cannot name types (tags), and its size, depth and number of values are limited, also where aliases
repeat parts of it. Numbers are decimal, as in YAML 1.2: 010 and 1:30, which YAML 1.1 reads as 8 and 90, are text here,
which no key that takes a number accepts.
"""

from __future__ import annotations

import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from pairsim.runtime.errors import InputError
from pairsim.runtime.text import as_typed, control_characters, printable

LARGEST_FILE = 2_000_000  # bytes; reading takes some 10 s per MB
MOST_VALUES = 250_000  # keys and values, counted as often as aliases repeat them
DEEPEST = 20  # groups and lists within each other
MOST_KEYS = 1000  # in one group
MOST_DIGITS = 400  # of a whole number; the largest number in double precision has 309
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
        """The value of a key; a missing one becomes an empty group, and the name of a law a group."""
        if key in ("liquid", "solid") and isinstance(name := self.get(key), str):
            self[key] = Section({"law": name}, {"law": self.places[key]} if key in self.places else {})
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


class _Loader(yaml.SafeLoader):
    """YAML without tags, with limits on size and depth, in which 1e-3 is a number and a repeated key is an error."""

    def __init__(self, text: str, name: str) -> None:
        super().__init__(text)
        self.name = name
        self._depth = 0
        self._extents: dict[yaml.Node, tuple[int, int]] = {}

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose a node, within the limits.

        Raises:
            yaml.composer.ComposerError: A limit is exceeded, a node contains itself, or it has a tag.
        """
        event = self.peek_event()

        def refuse(problem: str) -> yaml.composer.ComposerError:
            return yaml.composer.ComposerError(None, None, problem, event.start_mark)

        if (tag := getattr(event, "tag", None)) not in (None, "!"):
            raise refuse(f"must not have tags such as {as_typed(tag)}")
        if self._depth == DEEPEST:
            raise refuse(f"must have at most {DEEPEST} groups and lists within each other")
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        if node is None or node in self._extents:
            return node
        if isinstance(event, yaml.AliasEvent):
            raise refuse(f"*{event.anchor} must not contain itself")
        inner = [self._extents[each] for each in _children(node)]
        depth, values = 1 + max((depth for depth, _ in inner), default=0), 1 + sum(count for _, count in inner)
        if depth > DEEPEST:
            raise refuse(f"must have at most {DEEPEST} groups and lists within each other")
        if values > MOST_VALUES or len(self._extents) > MOST_VALUES:
            raise refuse(f"must have at most {MOST_VALUES} keys and values, aliases written out")
        self._extents[node] = depth, values
        return node

    def construct_scalar(self, node: yaml.ScalarNode | yaml.MappingNode) -> str:
        """The text of a scalar.

        Raises:
            yaml.constructor.ConstructorError: It has control characters.
        """
        text = str(super().construct_scalar(node))
        if found := control_characters(text):
            problem = f"text must not have control characters, such as {found}"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        return text

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        """A whole number.

        Raises:
            yaml.constructor.ConstructorError: It has too many digits.
        """
        if len(digits := self.construct_scalar(node)) > MOST_DIGITS:
            problem = f"{as_typed(digits)} must have at most {MOST_DIGITS} digits"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        return int(digits)

    def construct_section(self, node: yaml.MappingNode) -> Section:
        """A mapping. Keys must be strings and occur once; they may override keys merged with <<.

        Raises:
            yaml.constructor.ConstructorError: A key is not a string or occurs twice, or there are too many.
        """
        seen: set[str] = set()
        for key_node, _ in node.value:
            if key_node.tag == MERGE:
                continue
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str):
                problem = f"key {as_typed(key)} must be text"
                raise yaml.constructor.ConstructorError(None, None, problem, key_node.start_mark)
            if key in seen:
                problem = f"key {as_typed(key)} must be given only once"
                raise yaml.constructor.ConstructorError(None, None, problem, key_node.start_mark)
            seen.add(key)
        self.flatten_mapping(node)
        if len(node.value) > MOST_KEYS:
            problem = f"a group must have at most {MOST_KEYS} keys, not {len(node.value)}"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        section = Section()
        for key_node, value_node in node.value:
            place = Place(str(self.name), key_node.start_mark.line + 1)
            value = self.construct_object(value_node, deep=True)
            section.put(self.construct_object(key_node, deep=True), value, place)
        return section


def _children(node: yaml.Node) -> list[yaml.Node]:
    """The nodes directly within a node: the entries of a list, keys and values of a mapping."""
    if isinstance(node, yaml.MappingNode):
        return [each for pair in node.value for each in pair]
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []


_Loader.yaml_implicit_resolvers = {}  # those of YAML 1.1 are not inherited
_Loader.add_constructor("tag:yaml.org,2002:map", _Loader.construct_section)
_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_yaml_int)
for _kind, _pattern, _first in (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"(?:yes|no|true|false|on|off)", list("yYnNtTfFoO")),
    ("int", r"[-+]?(?:0|[1-9][0-9]*)", list("-+0123456789")),
    ("float", r"[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))(?:[eE][-+]?[0-9]+)?", list("-+0123456789.")),
    ("float", r"[-+]?\.inf|\.nan", list("-+.")),
    ("merge", r"<<", ["<"]),
):
    _flags = re.IGNORECASE if _kind == "bool" or "inf" in _pattern else 0
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", re.compile(rf"(?:{_pattern})\Z", _flags), _first)


def _parse(text: str, name: str) -> Any:
    """Parse a YAML text; `name` is the file in the places of its keys."""
    loader = _Loader(text, name)
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()


def _text_of(path: Path) -> str:
    """Read a text file of limited size.

    Raises:
        InputError: It is missing, unreadable, too large, not text, or not a regular file.
    """

    def refuse(allowed: str) -> InputError:
        return InputError(str(path), "", None, allowed)

    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise refuse("must be a file, but is a folder")
        if not stat.S_ISREG(status.st_mode):  # reading from a pipe may never end
            raise refuse("must be a file, but is a pipe or a device")
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise refuse("no such file") from None
    except OSError as error:
        raise refuse(f"cannot be read: {error.strerror}") from None
    except InputError:
        raise
    except ValueError:  # the name contains a null character or a lone surrogate
        raise refuse("must be the name of a file") from None
    if len(content) > LARGEST_FILE:
        raise refuse(f"must be a file of at most {LARGEST_FILE / 1e6:g} MB")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(str(path), "", None, "must be text in UTF-8", line=line) from None


def read_yaml(path: Path) -> Section:
    """Read a YAML file whose top level is a mapping.

    Raises:
        InputError: The file is missing, unreadable, not valid YAML, too large, or its top level is not a mapping.
    """
    name, text = str(path), _text_of(path)
    try:
        data = _parse(text, name)
    except yaml.YAMLError as error:
        line, problem = _problem(error, text)
        raise InputError(name, "", None, f"must be valid YAML: {problem}", line=line) from None
    if not isinstance(data, Section):
        raise InputError(name, "", None, "must contain keys and values, such as beta: 0.4; see pairsim schema")
    return data


def _problem(error: yaml.YAMLError, text: str) -> tuple[int | None, str]:
    """The line of an error of PyYAML, None if unknown, and what is wrong."""
    if isinstance(error, yaml.reader.ReaderError):
        return text.count(
            "\n", 0, error.position
        ) + 1, f"the character {printable(text[error.position])} is not allowed"
    if isinstance(error, yaml.MarkedYAMLError):
        return error.problem_mark.line + 1 if error.problem_mark else None, str(error.problem)
    return None, str(error)


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
        if not equals or not key or control_characters(setting):
            raise InputError(OPTION, "", setting, "must be key=value on one line, such as mesh.Np=20")
        try:
            value = _parse(text, OPTION)
        except yaml.YAMLError as error:
            raise InputError(OPTION, key, text, f"must be a valid YAML value: {_problem(error, text)[1]}") from None
        *groups, last = key.split(".")
        if len(groups) >= DEEPEST:
            raise InputError(OPTION, key, text, f"must have at most {DEEPEST} groups within each other")
        target = data
        for group in groups:
            target = target.group(group)
            if not isinstance(target, Section):
                raise InputError(OPTION, key, text, f"must be a key within a group, but {group} is not a group of keys")
        target.put(last, value, Place(OPTION, None))

"""Read YAML files, keeping the file and line of each key for error messages, and write them.

A file is data: it cannot name types (tags), and its size, depth and number of values are limited, also where aliases
repeat parts of it. The grammar is that of YAML 1.2 (ruamel.yaml), with one exception: whole numbers are decimal, and
010, which is 8 in YAML 1.1 and 10 in YAML 1.2, is text here, which no key that takes a number accepts.
"""

from __future__ import annotations

import io
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.composer import ComposerError
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

from pairsim.physics import liquids, solids
from pairsim.runtime.errors import InputError
from pairsim.runtime.text import as_typed, control_characters, printable

LARGEST_FILE = 2_000_000  # bytes; reading takes some 10 s per MB
MOST_VALUES = 250_000  # keys and values, counted as often as aliases repeat them
DEEPEST = 20  # groups and lists within each other
TOO_DEEP = f"must have at most {DEEPEST} groups and lists within each other"
OPTION = "--set"
MERGE = "tag:yaml.org,2002:merge"  # of the key <<


DEFAULT_LAWS = {"liquid": liquids.DEFAULT.name, "solid": solids.DEFAULT.name}


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
        """The value of a key; a missing one becomes a group, and so does the name of a law."""
        if key in DEFAULT_LAWS and isinstance(name := self.get(key, DEFAULT_LAWS[key]), str):
            self[key] = Section({"law": name}, {"law": self.places[key]} if key in self.places else {})
        return self.setdefault(key, Section())

    def within(self, dotted: str) -> tuple[Section, str]:
        """The group that a dotted key is in, which is made if it is missing, and the key in that group.

        Raises:
            ValueError: It goes through a value that is no group, or is too deep; says what it must be.
        """
        *groups, last = dotted.split(".")
        if len(groups) >= DEEPEST:
            raise ValueError(f"must have at most {DEEPEST} groups within each other")
        inner: Any = self
        for name in groups:
            inner = inner.group(name)
            if not isinstance(inner, Section):
                raise ValueError(f"must be a key within a group, but {name} is not a group of keys")
        return inner, last


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


class _Values:
    """Makes the values of a YAML text.

    Args:
        name: The file in the places of the keys.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._count = 0

    def of(self, node: Node, depth: int = 1) -> Any:
        """The value of a node, `depth` groups and lists deep.

        Raises:
            ComposerError: It has a tag, control characters, or keys that are wrong, or exceeds a limit.
        """
        self._count += 1
        if node.ctag.handle or not str(node.tag).startswith("tag:yaml.org,2002:"):
            raise _wrong(node, f"must not have tags such as {as_typed(str(node.tag))}")
        if self._count > MOST_VALUES:
            raise _wrong(node, f"must have at most {MOST_VALUES} keys and values, aliases written out")
        if isinstance(node, ScalarNode):
            return _scalar(node)
        if depth > DEEPEST:
            raise _wrong(node, TOO_DEEP)
        if isinstance(node, SequenceNode):
            return [self.of(each, depth + 1) for each in node.value]
        return self._section(node, depth)

    def _section(self, node: Node, depth: int) -> Section:
        """A group. Keys must be text and occur once; they override keys merged with <<."""
        own, merged = Section(), Section()
        for key_node, value_node in node.value:
            value = self.of(value_node, depth + 1)
            if key_node.tag == MERGE:
                for each in reversed(value if isinstance(value, list) else [value]):
                    if not isinstance(each, Section):
                        raise _wrong(value_node, "<< must name a group, or a list of groups")
                    merged.update(each)
                    merged.places.update(each.places)
                continue
            key = self.of(key_node, depth + 1)
            if not isinstance(key, str):
                raise _wrong(key_node, f"key {as_typed(key)} must be text")
            if key in own:
                raise _wrong(key_node, f"key {as_typed(key)} must be given only once")
            own.put(key, value, Place(self._name, key_node.start_mark.line + 1))
        return Section({**merged, **own}, {**merged.places, **own.places})


def _scalar(node: ScalarNode) -> Any:
    """The number, true, false, null or text of a node."""
    text, kind = node.value, str(node.tag).rpartition(":")[2]
    if found := control_characters(text):
        raise _wrong(node, f"text must not have control characters, such as {found}")
    try:
        if kind == "float":
            return float(re.sub(r"\.(?=[a-zA-Z])", "", text))  # .inf and .nan
        if kind == "int" and not re.match(r"[-+]?0\d", text):
            return int(text)
    except ValueError:  # 0x10, or more digits than Python converts
        return text
    if kind == "bool":
        return {"true": True, "false": False}.get(text.lower(), text)  # yes in a file with the heading %YAML 1.1
    return None if kind == "null" else text


def _wrong(node: Node, problem: str) -> ComposerError:
    return ComposerError(None, None, problem, node.start_mark)


def _parse(text: str, name: str) -> Any:
    """Parse a YAML text; `name` is the file in the places of its keys.

    Raises:
        YAMLError: It is not valid YAML, or exceeds a limit.
    """
    reader = YAML(typ="safe", pure=True)
    reader.composer.warn_double_anchors = False
    try:
        node = reader.compose(text)
    except RecursionError:
        raise YAMLError(TOO_DEEP) from None
    return None if node is None else _Values(name).of(node)


def _text_of(path: Path) -> str:
    """Read a text file of limited size.

    Raises:
        InputError: It is missing, unreadable, too large, not text, or not a regular file.
    """
    line = None
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            allowed = "must be a file, but is a folder"
        elif not stat.S_ISREG(status.st_mode):  # reading from a pipe may never end
            allowed = "must be a file, but is a pipe or a device"
        elif status.st_size > LARGEST_FILE:
            allowed = f"must be a file of at most {LARGEST_FILE / 1e6:g} MB"
        else:
            return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        allowed = "no such file"
    except OSError as error:
        allowed = f"cannot be read: {error.strerror}"
    except UnicodeDecodeError as error:
        allowed, line = "must be text in UTF-8", error.object.count(b"\n", 0, error.start) + 1
    raise InputError(str(path), "", None, allowed, line=line)


def read_yaml(path: Path) -> Section:
    """Read a YAML file whose top level is a mapping.

    Raises:
        InputError: The file is missing, unreadable, not valid YAML, too large, or its top level is not a mapping.
    """
    name, text = str(path), _text_of(path)
    try:
        data = _parse(text, name)
    except YAMLError as error:
        line, problem = _problem(error, text)
        raise InputError(name, "", None, f"must be valid YAML: {problem}", line=line) from None
    if not isinstance(data, Section):
        raise InputError(name, "", None, "must contain keys and values, such as beta: 0.4; see pairsim schema")
    return data


def _problem(error: YAMLError, text: str) -> tuple[int | None, str]:
    """The line of an error of the reader, None if unknown, and what is wrong."""
    if isinstance(error, ReaderError):
        character = printable(text[error.position])
        return text.count("\n", 0, error.position) + 1, f"the character {character} is not allowed"
    if isinstance(error, MarkedYAMLError):
        problem = "lines are indented by spaces, not by tabs" if "\\t" in str(error.problem) else str(error.problem)
        return error.problem_mark.line + 1 if error.problem_mark else None, problem
    return None, str(error)


def yaml_text(content: Mapping[str, Any], blocks: bool = False) -> str:
    """Keys and values as YAML that readers of YAML 1.1 understand, too, in their order.

    Args:
        content: Nested dicts, lists, texts, numbers, true, false and None.
        blocks: Whether the innermost groups and lists have a line for each entry; else they are {...} and [...].
    """
    writer = YAML(typ="safe", pure=True)
    writer.version = (1, 1)  # PyYAML reads 1e-05 without a point and yes without quotes as something else
    writer.default_flow_style = False if blocks else None
    writer.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    stream = io.StringIO()
    writer.dump(content, stream)
    return stream.getvalue().removeprefix("%YAML 1.1\n---\n")


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
            target, last = data.within(key)
        except YAMLError as error:
            raise InputError(OPTION, key, text, f"must be a valid YAML value: {_problem(error, text)[1]}") from None
        except ValueError as error:
            raise InputError(OPTION, key, text, str(error)) from None
        target.put(last, value, Place(OPTION, None))

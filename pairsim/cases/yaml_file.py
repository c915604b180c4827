"""Read YAML files, keeping the file and line of each key for error messages, change their keys, and write them.

A file is data: the loader is ruamel.yaml's safe one (YAML 1.2), which refuses tags that name types. Dates are text.
"""

from __future__ import annotations

import copy
import io
import re
from collections.abc import Collection, Mapping
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple, TextIO

from ruamel.yaml import YAML
from ruamel.yaml.constructor import ConstructorError, SafeConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node

from pairsim.physics import liquids, solids
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain
from pairsim.runtime.text import shortened

OPTION = "--set"
DEFAULT_LAWS = {"liquid": liquids.DEFAULT.name, "solid": solids.DEFAULT.name}
MOST_VALUES = 500_000
"""Values and keys in a file, as many as the cases of the largest grid have."""
LONGEST_PROBLEM = 300  # characters of what the reader says
TAG = "tag:yaml.org,2002:"
UNFIT = re.compile("[\0\ud800-\udfff]")  # what is in no name of a file


type Content = Mapping[str, Plain]
"""Keys with their values, such as those of a file: of none is it known yet whether it is right."""


class Place(NamedTuple):
    """Where a key was given: the file, or `--set`, and the line, None for `--set`."""

    file: str
    line: int | None


class PlacedKey(str):
    """A key that knows its place, if that is known. In a dict it is the same as its text."""

    place: Place | None

    def __new__(cls, text: str, place: Place | None = None) -> PlacedKey:
        key = super().__new__(cls, text)
        key.place = place
        return key

    def __deepcopy__(self, _: object) -> PlacedKey:
        return self


def _place_in(group: Content, name: str) -> Place | None:
    return next((getattr(key, "place", None) for key in group if key == name), None)


def place_of(data: Content, key: str) -> Place | None:
    """Where a dotted key, such as mesh.Np or cases[1].mesh.Np, was given.

    If it is missing, the place of what it would be in; None if that is unknown.
    """
    place = None
    inner: Any = data
    while key:
        index = re.match(r"\[(\d+)\]\.?", key)
        if index is not None:
            key = key[index.end() :]
            if isinstance(inner, list | tuple) and int(index[1]) < len(inner):
                inner = inner[int(index[1])]
                place = (isinstance(inner, Mapping) and _place_in(inner, next(iter(inner), ""))) or place
        elif not isinstance(inner, Mapping):
            break
        else:
            # A key may contain points, such as mesh.Np of a grid, and an unknown key anything.
            names = [key[: end.start()] for end in re.finditer(r"[.\[]|$", key)]
            name = next((name for name in reversed(names) if name in inner), names[0])
            place = _place_in(inner, name) or place
            inner = inner.get(name)
            key = key[max(len(name), 1) :].removeprefix(".")
    return place


def within(data: dict[str, Plain], dotted: str) -> tuple[dict[str, Plain], str]:
    """The group of a dotted key, created if it is missing, and the name of the key in that group.

    The name of a law becomes its block.

    Raises:
        ValueError: The key goes through a value that is no group.
    """
    *groups, last = re.findall(r"[^.\[\]]+", dotted)
    inner: Any = data
    law = bool(groups) and groups[0] in DEFAULT_LAWS
    for name in groups:
        at = int(name) if isinstance(inner, list) else name
        value = inner[at] if isinstance(inner, list) else inner.get(at, DEFAULT_LAWS.get(name, {}))
        if law and isinstance(value, str):
            value = {PlacedKey("law", _place_in(inner, name)): value}
        if not isinstance(value, Mapping | list):
            raise ValueError(f"must be a key within a group, but {name} is not a group of keys")
        # A copy, since an alias may share it.
        inner[at] = dict(value) if isinstance(value, Mapping) else list(value)
        inner = inner[at]
    if isinstance(inner, list):
        raise ValueError(f"must be a key within a group, but {groups[-1]} is a list")
    return inner, last


def merge(
    target: dict[str, Plain], changes: Content, groups: Collection[str], source: str = "", group: str = ""
) -> None:
    """Merge changes into nested keys and values, in place: groups of keys are merged, all other values are replaced.

    Groups are those of the case, as of `groups_of` its model. Changes are nested or have dotted keys. Error messages
    name `source` where the file of a key is not known, and keys with the prefix `group`, such as "mesh.".

    Raises:
        InputError: A dotted key goes through a value that is not a group.
    """
    for dotted, value in changes.items():
        place = getattr(dotted, "place", None)
        try:
            inner, last = within(target, dotted)
            more = value if isinstance(value, Mapping) else {}
            of_law = last in DEFAULT_LAWS and isinstance(value, Mapping) and "law" not in more
            in_group = last in groups and isinstance(value, Mapping) and isinstance(inner.get(last), Mapping)
            kept = within(inner, f"{last}.law")[0] if of_law or in_group else None
        except ValueError as error:
            file, line = place or (source, None)
            raise InputError(file, f"{group}{dotted}", value, str(error), line=line) from None
        if kept is not None:
            merge(kept, more, groups, source, f"{group}{dotted}.")
        else:
            inner.pop(last, None)  # with its place
            inner[PlacedKey(last, place)] = copy.deepcopy(value)


def apply_settings(data: dict[str, Plain], overrides: tuple[str, ...], groups: Collection[str]) -> None:
    """Apply settings key=value with dotted keys, as given to --set, to nested keys and values, in place.

    Groups are those of `merge`.

    Raises:
        InputError: A setting is not of the form key=value, or its key goes through a value that is not a group.
    """
    for setting in overrides:
        key, equals, text = setting.partition("=")
        if not equals or not key.strip(".[]") or "\n" in setting:
            raise InputError(OPTION, "", setting, "must be key=value on one line, such as mesh.Np=20")
        try:
            value = _load(text, OPTION)
        except InputError as error:
            raise InputError(OPTION, key, text, error.allowed) from None
        merge(data, {PlacedKey(key, Place(OPTION, None)): value}, groups, OPTION)


def flat(entry: Content, prefix: str = "") -> dict[str, Plain]:
    """Convert nested keys to dotted keys; the name of a law stands for its group, as in liquid and liquid.alpha."""
    spelled: dict[str, Plain] = {}
    for key, value in entry.items():
        if isinstance(value, dict):
            spelled |= flat(value, f"{prefix}{key}.")
        else:
            spelled[prefix.removesuffix(".") if prefix and key == "law" else prefix + key] = value
    return spelled


class _Constructor(SafeConstructor):
    """Makes dicts of groups, each key of which knows its line.

    What a scalar cannot be, such as `!!int x`, is a ConstructorError with its line, as all that is refused.
    """

    def construct_document(self, node: Node) -> Any:
        if (count := _count(node, {})) > MOST_VALUES:
            problem = f"it has {count:,} values and keys with those that aliases repeat, of at most {MOST_VALUES:,}"
            raise ConstructorError(None, None, problem, None)
        return super().construct_document(node)

    def construct_non_recursive_object(self, node: Node, tag: str | None = None) -> Any:
        try:
            return super().construct_non_recursive_object(node, tag)
        except (ValueError, LookupError, OverflowError):
            problem = f"{shortened(repr(node.value))} cannot be read as !!{str(node.tag).rpartition(':')[2]}"
            raise ConstructorError(None, None, problem, node.start_mark) from None

    def group(self, node: MappingNode) -> dict[PlacedKey, Any]:
        values = self.construct_mapping(node, deep=True)
        for key, _ in node.value:
            if key.tag != TAG + "str":
                raise ConstructorError(None, None, f"key {key.value} must be text", key.start_mark)
        lines = {key.value: key.start_mark for key, _ in node.value}
        return {PlacedKey(key, Place(lines[key].name, lines[key].line + 1)): value for key, value in values.items()}

    def number(self, node: Node) -> float:
        return float(self.construct_yaml_float(node)) + 0.0  # no -0.0, which would make another case

    def whole(self, node: Node) -> int:
        value = int(self.construct_yaml_int(node))
        float(value)  # an OverflowError, if it is larger than numbers can be
        return value

    def nothing(self, node: Node) -> None:
        if self.construct_scalar(node).lower() not in ("", "~", "null"):
            raise ValueError

    def text(self, node: Node) -> str:
        value = str(self.construct_scalar(node))
        if UNFIT.search(value):
            problem = f"a text must not have the character {UNFIT.findall(value)[0]!r}"
            raise ConstructorError(None, None, problem, node.start_mark)
        return value

    def refuse(self, node: Node) -> None:
        raise ConstructorError(None, None, f"tags such as {node.tag} are not allowed", node.start_mark)


for _tag in (None, *(TAG + name for name in ("binary", "omap", "pairs", "set"))):
    _Constructor.add_constructor(_tag, _Constructor.refuse)
_Constructor.add_constructor(TAG + "map", _Constructor.group)
_Constructor.add_constructor(TAG + "float", _Constructor.number)
_Constructor.add_constructor(TAG + "int", _Constructor.whole)
_Constructor.add_constructor(TAG + "null", _Constructor.nothing)
for _tag in (TAG + "str", TAG + "timestamp"):
    _Constructor.add_constructor(_tag, _Constructor.text)


def _count(node: Node, counts: dict[Node, int]) -> int:
    """The number of values and keys below a node and with it, those that aliases repeat included.

    Raises:
        ConstructorError: A node is below itself.
    """
    if (known := counts.get(node)) is not None:
        if not known:  # not counted to the end yet
            raise ConstructorError(None, None, "an alias must not be within what it stands for", node.start_mark)
        return known
    counts[node] = 0
    children = chain.from_iterable(node.value) if isinstance(node, MappingNode) else node.value
    total = 1 if isinstance(node.value, str) else 1 + sum(_count(child, counts) for child in children)
    counts[node] = total
    return total


def _load(stream: TextIO | str, file: str) -> Any:
    """The value of a YAML text; InputError where it is not valid YAML, or has tags."""
    reader = YAML(typ="safe", pure=True)
    reader.Constructor = _Constructor
    reader.composer.warn_double_anchors = False
    try:
        return reader.load(stream)
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        problem = "lines are indented by spaces, not by tabs" if "\\t" in str(error.problem) else str(error.problem)
        if len(problem) > LONGEST_PROBLEM:  # of a duplicate key, with both values
            problem = problem.partition(" with value ")[0]
        raise InputError(file, "", None, f"must be valid YAML: {problem}", line=line) from None
    except RecursionError:
        raise InputError(file, "", None, "must be valid YAML: groups and lists are nested too deeply") from None
    except (YAMLError, ValueError) as error:
        raise InputError(file, "", None, f"must be valid YAML in UTF-8: {str(error).splitlines()[0]}") from None


def read_yaml(path: Path) -> dict[str, Plain]:
    """Read a YAML file whose top level is a mapping; its keys, and those of groups in it, know their places.

    Raises:
        InputError: The file is missing, unreadable or not valid YAML, or its top level is not a mapping.
    """
    try:
        with path.open(encoding="utf-8") as stream:
            data = _load(stream, str(path))
    except FileNotFoundError:
        raise InputError(str(path), "", None, "no such file") from None
    except OSError as error:
        raise InputError(str(path), "", None, f"must be a file that can be read: {error.strerror}") from None
    if not isinstance(data, dict):
        raise InputError(str(path), "", None, "must contain keys and values, such as beta: 0.4; see pairsim schema")
    return data


def yaml_text(content: Content, blocks: bool = False) -> str:
    """Keys and values as YAML that readers of YAML 1.1 understand, too, in their order.

    With `blocks` the innermost groups and lists have a line for each entry; else they are {...} and [...].
    """
    writer = YAML(typ="safe", pure=True)
    writer.version = (1, 1)  # PyYAML reads 1e-05 without a point and yes without quotes as something else
    writer.default_flow_style = False if blocks else None
    writer.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    stream = io.StringIO()
    writer.dump(content, stream)
    return stream.getvalue().removeprefix("%YAML 1.1\n---\n")

"""The reader of YAML texts: ruamel.yaml's safe one (YAML 1.2), which refuses tags that name types; dates are text."""

from __future__ import annotations

import re
from itertools import chain
from typing import Any, TextIO

from ruamel.yaml import YAML
from ruamel.yaml.constructor import ConstructorError, SafeConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node

from pairsim.cases.placed_keys import Place, PlacedKey
from pairsim.runtime.errors import InputError
from pairsim.runtime.text import shortened

MOST_VALUES = 500_000
"""Values and keys in a file, as many as the cases of the largest grid have."""
LONGEST_PROBLEM = 300  # characters of a message of the reader
TAG = "tag:yaml.org,2002:"
UNFIT = re.compile("[\0\ud800-\udfff]")  # characters that no file name can have


class _Constructor(SafeConstructor):
    """Turns mappings into dicts whose keys know their lines.

    All that is refused, such as the scalar `!!int x`, is a ConstructorError with its line.
    """

    def construct_document(self, node: Node) -> Any:
        if (count := _count(node, {})) > MOST_VALUES:
            problem = f"it has {count:,} values and keys, with those that aliases repeat; {MOST_VALUES:,} are allowed"
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
        return float(self.construct_yaml_float(node)) + 0.0  # turns -0.0 into 0.0, lest one case have two hashes

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
            problem = f"text must not contain the character {UNFIT.findall(value)[0]!r}"
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
    """The number of values and keys in a node, itself included, with those that aliases repeat.

    Raises:
        ConstructorError: A node contains itself.
    """
    if (known := counts.get(node)) is not None:
        if not known:  # not counted to the end yet
            raise ConstructorError(None, None, "an alias must not stand inside the value it refers to", node.start_mark)
        return known
    counts[node] = 0
    children = chain.from_iterable(node.value) if isinstance(node, MappingNode) else node.value
    total = 1 if isinstance(node.value, str) else 1 + sum(_count(child, counts) for child in children)
    counts[node] = total
    return total


def load(stream: TextIO | str, file: str) -> Any:
    """The value of a YAML text; InputError if it is not valid YAML, or has tags."""
    reader = YAML(typ="safe", pure=True)
    reader.Constructor = _Constructor
    reader.composer.warn_double_anchors = False
    try:
        return reader.load(stream)
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        problem = "there must be spaces in place of tabs" if "\\t" in str(error.problem) else str(error.problem)
        if len(problem) > LONGEST_PROBLEM:  # of a duplicate key, with both values
            problem = problem.partition(" with value ")[0]
        raise InputError(file, "", None, f"must be valid YAML: {problem}", line=line) from None
    except RecursionError:
        raise InputError(file, "", None, "must be valid YAML: groups and lists are nested too deeply") from None
    except (YAMLError, ValueError) as error:
        raise InputError(file, "", None, f"must be valid YAML in UTF-8: {str(error).splitlines()[0]}") from None

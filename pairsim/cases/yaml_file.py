"""Read YAML files, keeping the file and line of each key for error messages, change their keys, and write them.

The YAML library takes a while to import, and is imported only to read or write a file: an answer may need none.
"""

from __future__ import annotations

import copy
import io
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from pairsim.cases.placed_keys import Place, PlacedKey, place_in
from pairsim.physics import liquids, solids
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain

OPTION = "--set"
DEFAULT_LAWS = {"liquid": liquids.DEFAULT.name, "solid": solids.DEFAULT.name}


type Content = Mapping[str, Plain]
"""Keys with their values, such as those of a file, which need not be valid."""


def within(data: dict[str, Plain], dotted: str) -> tuple[dict[str, Plain], str]:
    """The group of a dotted key, created if it is missing, and the name of the key in that group.

    If a law on the way is given by its name, it is replaced by a block.

    Raises:
        ValueError: The key goes through a value that is not a group.
    """
    *groups, last = re.findall(r"[^.\[\]]+", dotted)
    inner: Any = data
    law = bool(groups) and groups[0] in DEFAULT_LAWS
    for name in groups:
        at = int(name) if isinstance(inner, list) else name
        value = inner[at] if isinstance(inner, list) else inner.get(at, DEFAULT_LAWS.get(name, {}))
        if law and isinstance(value, str):
            value = {PlacedKey("law", place_in(inner, name)): value}
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

    Args:
        target: The nested keys and values.
        changes: The changes, nested or with dotted keys.
        groups: The names of the groups of the case, see `groups_of`.
        source: The file that error messages name for keys whose file is not known.
        group: The prefix of keys in error messages, such as "mesh.".

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

    `groups` are as in `merge`.

    Raises:
        InputError: A setting is not of the form key=value, or its key goes through a value that is not a group.
    """
    if overrides:
        from pairsim.cases.yaml_loader import load

    for setting in overrides:
        key, equals, text = setting.partition("=")
        if not equals or not key.strip(".[]") or "\n" in setting:
            raise InputError(OPTION, "", setting, "must be key=value on one line, such as mesh.Np=20")
        try:
            value = load(text, OPTION)
        except InputError as error:
            raise InputError(OPTION, key, text, error.allowed) from None
        merge(data, {PlacedKey(key, Place(OPTION, None)): value}, groups, OPTION)


def flat(entry: Content, prefix: str = "") -> dict[str, Plain]:
    """Convert nested keys to dotted ones; the name of a law has the key of its group: liquid beside liquid.alpha."""
    spelled: dict[str, Plain] = {}
    for key, value in entry.items():
        if isinstance(value, dict):
            spelled |= flat(value, f"{prefix}{key}.")
        else:
            spelled[prefix.removesuffix(".") if prefix and key == "law" else prefix + key] = value
    return spelled


def read_yaml(path: Path) -> dict[str, Plain]:
    """Read a YAML file whose top level is a mapping; its keys, and those of groups in it, know their places.

    Raises:
        InputError: The file is missing, unreadable or not valid YAML, or its top level is not a mapping.
    """
    from pairsim.cases.yaml_loader import load

    try:
        with path.open(encoding="utf-8") as stream:
            data = load(stream, str(path))
    except FileNotFoundError:
        raise InputError(str(path), "", None, "no such file") from None
    except OSError as error:
        raise InputError(str(path), "", None, f"must be a readable file: {error.strerror}") from None
    if not isinstance(data, dict):
        raise InputError(str(path), "", None, "must contain keys and values, such as beta: 0.4; see pairsim schema")
    return data


def yaml_text(content: Content, blocks: bool = False) -> str:
    """Keys and values as YAML in their order; readers of YAML 1.1 understand it, too.

    With `blocks` the innermost groups and lists have one line per entry; otherwise they are {...} and [...].
    """
    from ruamel.yaml import YAML

    writer = YAML(typ="safe", pure=True)
    writer.version = (1, 1)  # PyYAML reads 1e-05 without a point and yes without quotes as something else
    writer.default_flow_style = False if blocks else None
    writer.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    stream = io.StringIO()
    writer.dump(content, stream)
    return stream.getvalue().removeprefix("%YAML 1.1\n---\n")

"""Merge changes into the keys of a case: groups of keys are merged, all other values are replaced."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from pairsim.cases.physical import BLOCK
from pairsim.cases.yaml_file import DEFAULT_LAWS, Section, places_in
from pairsim.runtime.errors import InputError

GROUPS = ("mesh", "time", "limits", "output", BLOCK)  # keys of a case whose value is a group of keys


def merge(target: Section, changes: Mapping[str, Any], source: str = "", group: str = "") -> None:
    """Merge changes into nested keys and values, in place.

    Args:
        target: Keys and values, groups nested.
        changes: New keys and values, groups nested or as dotted keys.
        source: Name of the changes in messages, where the places of their keys are not known.
        group: Prefix of the keys in messages, such as "mesh.".

    Raises:
        InputError: A dotted key goes through a value that is not a group.
    """
    places = places_in(changes)
    for dotted, value in changes.items():
        place = places.get(dotted)
        try:
            inner, last = target.within(dotted)
            of_law = last in DEFAULT_LAWS and isinstance(value, Mapping) and "law" not in value
            grouped = of_law or (last in GROUPS and isinstance(value, Mapping) and isinstance(inner.get(last), Mapping))
            held = inner.group(last) if grouped else inner
        except ValueError as error:
            file, line = place or (source, None)
            raise InputError(file, f"{group}{dotted}", value, str(error), line=line) from None
        if grouped:
            merge(held, value, source, f"{group}{dotted}.")
        else:
            new = copy.deepcopy(value)
            inner.put(last, section_of(new) if isinstance(new, Mapping) else new, place)


def flat(entry: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Convert nested keys to dotted keys; the name of a law stands for its group, as in liquid and liquid.alpha."""
    spelled: dict[str, Any] = {}
    for key, value in entry.items():
        if isinstance(value, dict):
            spelled |= flat(value, f"{prefix}{key}.")
        else:
            spelled[prefix.removesuffix(".") if prefix and key == "law" else prefix + key] = value
    return spelled


def section_of(data: Mapping[str, Any]) -> Section:
    """Convert nested mappings to sections; sections among them keep the places of their keys."""
    if isinstance(data, Section):
        return data
    return Section({key: section_of(value) if isinstance(value, Mapping) else value for key, value in data.items()})

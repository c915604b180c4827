"""Merge changes into the keys of a case: groups of keys are merged, all other values are replaced."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from pairsim.config.physical import BLOCK
from pairsim.config.yaml_file import Section, places_in

GROUPS = ("mesh", "time", "limits", "output", BLOCK)  # keys of a case whose value is a group of keys


def merge(
    target: Section, changes: Mapping[str, Any], refuse: Callable[[str, Any, str], NoReturn], group: str = ""
) -> None:
    """Merge changes into nested keys and values, in place.

    Args:
        target: Keys and values, groups nested.
        changes: New keys and values, groups nested or as dotted keys.
        refuse: Raises an InputError for a key, its value and a message.
        group: Prefix of the keys in error messages, such as "mesh.".

    Raises:
        InputError: A dotted key goes through a value that is not a group; raised by `refuse`.
    """
    places = places_in(changes)
    for dotted, value in changes.items():
        try:
            inner, last = target.within(dotted)
        except ValueError as error:
            refuse(f"{group}{dotted}", value, str(error))
        of_law = last in ("liquid", "solid") and isinstance(value, Mapping) and "law" not in value
        if isinstance(value, Mapping) and isinstance(inner.get(last), Section) and (last in GROUPS or of_law):
            merge(inner[last], value, refuse, f"{group}{dotted}.")
        else:
            new = copy.deepcopy(value)
            inner.put(last, section_of(new) if isinstance(new, Mapping) else new, places.get(dotted))


def section_of(data: Mapping[str, Any]) -> Section:
    """Convert nested mappings to sections; sections among them keep the places of their keys."""
    if isinstance(data, Section):
        return data
    return Section({key: section_of(value) if isinstance(value, Mapping) else value for key, value in data.items()})

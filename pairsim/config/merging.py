"""Changes of a case's keys: dotted keys, groups that are merged, and everything else that is replaced."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from pairsim.config.physical import BLOCK
from pairsim.config.yaml_file import Place, Section

GROUPS = ("mesh", "time", "limits", "output", BLOCK)  # keys of a case that hold keys


def merge(
    target: Section, changes: Mapping[str, Any], refuse: Callable[[str, Any, str], NoReturn], group: str = ""
) -> None:
    """Put changes into nested data, in place.

    Args:
        target: Keys and values, groups nested.
        changes: The same, dotted keys allowed.
        refuse: Raises the error for a key, its value and what is wrong.
        group: What the keys begin with in an error.
    """
    places: Mapping[str, Place] = changes.places if isinstance(changes, Section) else {}
    for dotted, value in changes.items():
        *groups, last = dotted.split(".")
        inner: Any = target
        for name in groups:
            inner = inner.group(name)
            if not isinstance(inner, Section):
                refuse(f"{group}{dotted}", value, f"{name} is not a group of keys")
        if isinstance(value, Mapping) and isinstance(inner.get(last), Section) and last in GROUPS:
            merge(inner[last], value, refuse, f"{group}{dotted}.")
        else:
            own = copy.deepcopy(value)
            inner.put(last, section_of(own) if isinstance(own, Mapping) else own, places.get(dotted))


def section_of(data: Mapping[str, Any]) -> Section:
    """Nested keys and values as sections, which know no places unless they did before."""
    if isinstance(data, Section):
        return data
    return Section({key: section_of(value) if isinstance(value, Mapping) else value for key, value in data.items()})

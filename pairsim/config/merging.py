"""Changes of a case's keys: dotted keys, groups that are merged, and everything else that is replaced."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

GROUPS = ("mesh", "time", "limits", "output")  # keys of a case that hold keys


def merge(
    target: dict[str, Any], changes: Mapping[str, Any], refuse: Callable[[str, Any, str], NoReturn], group: str = ""
) -> None:
    """Put changes into nested data, in place.

    Args:
        target: Keys and values, groups nested.
        changes: The same, dotted keys allowed.
        refuse: Raises the error for a key, its value and what is wrong.
        group: What the keys begin with in an error.
    """
    for dotted, value in changes.items():
        *groups, last = dotted.split(".")
        inner = target
        for name in groups:
            inner = inner.setdefault(name, {})
            if not isinstance(inner, dict):
                refuse(f"{group}{dotted}", value, f"{name} is not a group of keys")
        if isinstance(value, Mapping) and isinstance(inner.get(last), dict) and last in GROUPS:
            merge(inner[last], value, refuse, f"{group}{dotted}.")
        else:
            inner[last] = copy.deepcopy(value)

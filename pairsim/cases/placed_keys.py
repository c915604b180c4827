"""Keys that know where they were given, for messages about mistakes in them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from pairsim.runtime.plain import Plain


class Place(NamedTuple):
    """Where a key was given: the file, or `--set`, and the line, None for `--set`."""

    file: str
    line: int | None


class PlacedKey(str):
    """A key with the place where it was given, None if that is unknown. In a dict it equals its text."""

    place: Place | None

    def __new__(cls, text: str, place: Place | None = None) -> PlacedKey:
        key = super().__new__(cls, text)
        key.place = place
        return key

    def __deepcopy__(self, _: object) -> PlacedKey:
        return self


def place_in(group: Mapping[str, Plain], name: str) -> Place | None:
    """Where a key of a group was given, if that is known."""
    return next((getattr(key, "place", None) for key in group if key == name), None)


def place_of(data: Mapping[str, Plain], key: str) -> Place | None:
    """Where a dotted key, such as mesh.Np or cases[1].mesh.Np, was given.

    If the key is missing, this is the place of the innermost group that would contain it; None if unknown.
    """
    place = None
    inner: Any = data
    while key:
        index = re.match(r"\[(\d+)\]\.?", key)
        if index is not None:
            key = key[index.end() :]
            if isinstance(inner, list | tuple) and int(index[1]) < len(inner):
                inner = inner[int(index[1])]
                place = (isinstance(inner, Mapping) and place_in(inner, next(iter(inner), ""))) or place
        elif not isinstance(inner, Mapping):
            break
        else:
            # A key may contain points, such as mesh.Np of a grid, and an unknown key anything.
            names = [key[: end.start()] for end in re.finditer(r"[.\[]|$", key)]
            name = next((name for name in reversed(names) if name in inner), names[0])
            place = place_in(inner, name) or place
            inner = inner.get(name)
            key = key[max(len(name), 1) :].removeprefix(".")
    return place

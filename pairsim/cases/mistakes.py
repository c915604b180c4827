"""Mistakes found by the checks of a case, and the InputError that reports them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from pairsim.cases.placed_keys import place_of
from pairsim.cases.yaml_file import Content
from pairsim.runtime.errors import InputError


class Mistake(NamedTuple):
    """A mistake in a dotted key ("" for the whole file): its value, None if it is not given, and what is allowed."""

    key: str
    value: Any
    allowed: str


def missing(key: str, needed: str) -> Mistake:
    """The mistake of a required key that is not given; `needed` says what it must be."""
    return Mistake(key, None, f"is missing; {needed}")


def input_error(mistakes: Iterable[Mistake], data: Content, source: str, entry: str = "") -> InputError:
    """Combine all mistakes of a case, at least one, into one error, in the order of the file and missing keys last.

    Args:
        mistakes: The mistakes.
        data: The content of the file, in which a `PlacedKey` has its file and line.
        source: The file that is named for all other keys.
        entry: The name of the case in a file of several cases.
    """

    def error(mistake: Mistake) -> InputError:
        file, line = place_of(data, mistake.key) or (source, None)
        value = list(mistake.value) if isinstance(mistake.value, tuple) else mistake.value
        return InputError(file, mistake.key, value, mistake.allowed, line=line, entry=entry)

    return InputError.of_all(map(error, mistakes))

"""Mistakes found by the checks of a case, and the InputError that reports them."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from pydantic import BaseModel

from pairsim.cases.yaml_file import place_of
from pairsim.runtime.errors import InputError


@dataclass(frozen=True)
class Mistake:
    """A mistake in one key.

    Attributes:
        key: Dotted key, empty for a mistake of the whole file.
        value: Its value, None if it is not given.
        allowed: The message: what is allowed.
        meant: For an unknown key, the key that was probably meant, or an empty string.
    """

    key: str
    value: Any
    allowed: str
    meant: str = ""

    @property
    def is_missing(self) -> bool:
        """Whether a required key is missing."""
        return self.value is None and self.allowed.startswith(_MISSING)

    @property
    def is_unknown(self) -> bool:
        """Whether the key is unknown."""
        return self.allowed.startswith(UNKNOWN)


_MISSING = "is missing; "
UNKNOWN = "unknown key; "


def missing(key: str, needed: str) -> Mistake:
    """The mistake of a required key that is not given; `needed` says what it must be."""
    return Mistake(key, None, f"{_MISSING}{needed}")


def broken(case: BaseModel, *rules: tuple[str, bool, str]) -> Iterator[Mistake]:
    """The mistakes in a case: for each rule its dotted key, whether it is broken, and what the key must be."""
    for key, wrong, allowed in rules:
        if wrong:
            yield Mistake(key, attrgetter(key)(case), allowed)


def input_error(mistakes: Sequence[Mistake], data: Mapping[str, Any], source: str, entry: str = "") -> InputError:
    """Combine all mistakes of a case into one error.

    Args:
        mistakes: The mistakes, at least one.
        data: The case as given; a `Section` has the file and line of its keys.
        source: Name of the file for keys without a known place.
        entry: Name of the case within a file of several cases, else empty.

    Returns:
        The error, with the mistakes in the order of the file and missing keys last.
    """

    def error(mistake: Mistake) -> InputError:
        file, line = place_of(data, mistake.key) or (source, None)
        value = list(mistake.value) if isinstance(mistake.value, tuple) else mistake.value
        return InputError(file, mistake.key, value, mistake.allowed, line=line, entry=entry)

    return InputError.of_all(map(error, mistakes))


def without(data: Mapping[str, Any], mistakes: Iterable[Mistake]) -> dict[str, Any]:
    """A copy of nested keys and values without the keys that have mistakes; lists with wrong entries are left out."""
    rest = copy.deepcopy(dict(data))
    for mistake in mistakes:
        key = mistake.key.partition("[")[0]
        inner: Any = rest
        while isinstance(inner, dict) and key not in inner and "." in key:
            group, _, key = key.partition(".")
            inner = inner.get(group)
        if isinstance(inner, dict):
            inner.pop(key, None)
    return rest

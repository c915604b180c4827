"""Mistakes found by the checks of a case, and the InputError that reports them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pairsim.config.yaml_file import place_of
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

    def error(mistake: Mistake, others: Sequence[InputError] = ()) -> InputError:
        place = place_of(data, mistake.key)
        file, line = (source, None) if place is None else place
        value = list(mistake.value) if isinstance(mistake.value, tuple) else mistake.value
        return InputError(file, mistake.key, value, mistake.allowed, line=line, entry=entry, others=others)

    def order(mistake: Mistake) -> tuple[bool, str, int]:
        """Sort key: file and line; keys without a line come last."""
        file, line = place_of(data, mistake.key) or (source, None)
        return line is None, file, line or 0

    first, *rest = sorted(mistakes, key=order)
    return error(first, [error(mistake) for mistake in rest])

"""Mistakes in a case: found by the checks, put into one error in the words of the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pairsim.config.yaml_file import place_of
from pairsim.runtime.errors import InputError


@dataclass(frozen=True)
class Mistake:
    """What is wrong with one key.

    Attributes:
        key: Dotted key, empty if the file as a whole is meant.
        value: Its value, None where it is not given.
        allowed: What must be, in words.
        meant: Key that was probably meant by an unknown one.
    """

    key: str
    value: Any
    allowed: str
    meant: str = ""

    @property
    def is_missing(self) -> bool:
        """Whether the key is needed and not given."""
        return self.value is None and self.allowed.startswith(_MISSING)

    @property
    def is_unknown(self) -> bool:
        """Whether there is no such key."""
        return self.allowed.startswith(UNKNOWN)


_MISSING = "is missing; "
UNKNOWN = "unknown key; "


def missing(key: str, needed: str) -> Mistake:
    """A key that is not given although it is needed."""
    return Mistake(key, None, f"{_MISSING}{needed}")


def input_error(mistakes: Sequence[Mistake], data: Mapping[str, Any], source: str, entry: str = "") -> InputError:
    """One error that tells all mistakes of a case.

    Args:
        mistakes: One or more.
        data: The case as given; a `Section` knows on which lines its keys stand.
        source: File that they are in where the data does not know it.
        entry: The case among those of the file, empty if it holds one.
    """

    def error(mistake: Mistake, others: Sequence[InputError] = ()) -> InputError:
        place = place_of(data, mistake.key)
        file, line = (source, None) if place is None else place
        value = list(mistake.value) if isinstance(mistake.value, tuple) else mistake.value
        return InputError(file, mistake.key, value, mistake.allowed, line=line, entry=entry, others=others)

    def order(mistake: Mistake) -> tuple[bool, str, int]:
        """From top to bottom of each file, then what is missing."""
        file, line = place_of(data, mistake.key) or (source, None)
        return line is None, file, line or 0

    first, *rest = sorted(mistakes, key=order)
    return error(first, [error(mistake) for mistake in rest])

"""Values, names and paths as text for messages: of limited length, on one line, without control characters."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping, Sequence
from itertools import islice
from typing import Any

LONGEST = 80  # characters of a value in a message
CONTROL = ("Cc", "Cs")  # Unicode categories: control characters, and halves of surrogate pairs, which no file can hold

MOST_ENTRIES, MOST_LEVELS = 8, 4  # of groups and lists


def as_typed(value: Any, levels: int = MOST_LEVELS) -> str:
    """A value as it would be typed in a file, shortened.

    Numbers have fifteen digits, so that the rounding error of a conversion does not show: 0.34, not
    0.33999999999999997.

    Args:
        value: The value.
        levels: Number of groups and lists within each other that are shown.
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return shortened(str(value), LONGEST // 2)
    if isinstance(value, float):
        return f"{value:.15g}"
    if isinstance(value, Mapping | list | tuple):
        return _entries(value, levels)
    return "null" if value is None else repr(shortened(value, LONGEST) if isinstance(value, str) else value)


def _entries(value: Mapping[Any, Any] | Sequence[Any], levels: int) -> str:
    """The first entries of a group or list."""
    most = MOST_ENTRIES if levels else 0
    more = ["…"] if len(value) > most else []
    if isinstance(value, Mapping):
        pairs = islice(value.items(), most)
        shown = [f"{printable(str(key), LONGEST)}: {as_typed(entry, levels - 1)}" for key, entry in pairs]
        return "{" + ", ".join(shown + more) + "}"
    shown = [as_typed(entry, levels - 1) for entry in islice(value, most)]
    return f"[{', '.join(shown + more)}]"


def printable(text: str, longest: int | None = None) -> str:
    """A text with each character that would not print as itself escaped, such as \\n.

    Args:
        text: The text.
        longest: Number of characters to which it is shortened; None: no limit.
    """
    if longest is not None:
        text = shortened(text, longest)
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def shortened(text: str, longest: int) -> str:
    """A text whose middle is left out if it is longer than `longest` characters."""
    if len(text) <= longest:
        return text
    half = (longest - 1) // 2
    return f"{text[:half]}…{text[-half:]}"


def control_characters(text: str) -> str:
    """The control characters and lone surrogates in a text, escaped; empty if there are none."""
    found = dict.fromkeys(c for c in text if unicodedata.category(c) in CONTROL)
    return printable("".join(list(found)[:5]))

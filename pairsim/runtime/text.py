"""Values, names and paths as text for messages: of limited length, on one line, without control characters."""

from __future__ import annotations

import reprlib
import unicodedata
from typing import Any

LONGEST = 80  # characters of a value in a message
CONTROL = ("Cc", "Cs")  # Unicode categories: control characters, and halves of surrogate pairs, which no file can hold

_repr = reprlib.Repr(maxstring=LONGEST, maxother=LONGEST, maxlong=40, maxlist=8, maxtuple=8, maxdict=8, fillvalue="…")


def shown(value: Any) -> str:
    """A value as a message gives it: as Python writes it, but true and false as in YAML; shortened."""
    if isinstance(value, bool):
        return str(value).lower()
    try:
        return shortened(_repr.repr(value), 2 * LONGEST)
    except ValueError:  # Python refuses to write integers of more than 4300 digits
        return "a number of more than 4300 digits" if isinstance(value, int) else f"a {type(value).__name__}"


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

"""Values and durations as text for messages."""

from __future__ import annotations

from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import Any

LONGEST = 80  # characters of a value in a message


def as_typed(value: Any) -> str:
    """A value as it would be typed in a file, shortened.

    Numbers have fifteen digits, so that the rounding error of a conversion does not show: 0.34, not
    0.33999999999999997.
    """
    return shortened(_typed(value))


def _typed(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.15g}"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_typed(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_typed, value))}]"
    return "null" if value is None else repr(value)


def shortened(text: str) -> str:
    """The text, with its middle left out if it is longer than `LONGEST`."""
    half = LONGEST // 2
    return text if len(text) <= LONGEST else f"{text[:half]}…{text[-half:]}"


def printable(text: str) -> str:
    r"""The text with bytes that are not UTF-8, such as those in names of files, written as \xe9."""
    return text.encode(errors="surrogateescape").decode(errors="backslashreplace")


def pasteable(path: Path | str) -> str:
    """A path as it can be pasted into a shell: quoted where it has spaces or other special characters."""
    return quote(str(path))


def decoded(content: bytes) -> str:
    """The text of a file of a spreadsheet or an instrument: UTF-16 with its mark, UTF-8, or else that of Windows."""
    if content.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def counted(number: int, noun: str) -> str:
    """A number and its noun as text: 1 point, 2 points."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def duration(seconds: float) -> str:
    """Format a duration in seconds as text: 42 s, 3 min 20 s, 2 h 05 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"

"""Which names of files and folders can be used."""

from __future__ import annotations

LONGEST_NAME = 200  # bytes in UTF-8; file systems take 255, of which hashes and temporary names need some
LONGEST_PATH = 4000  # bytes; Linux takes 4096


def fits_a_folder(name: str) -> bool:
    """Whether a text can be the name of a folder: not hidden, not too long, and printable on one line."""
    is_one = bool(name) and not name.startswith(".") and "/" not in name
    return is_one and name.isprintable() and len(name.encode()) <= LONGEST_NAME


def wrong_in(path: str) -> str:
    """What a path must be for files to be read or written under it, empty if it is that."""
    try:
        parts = [part.encode() for part in path.split("/")]
    except UnicodeEncodeError:  # bytes that are not UTF-8: they could not be recorded in run.json
        return "must be a path in UTF-8"
    if any(len(part) > LONGEST_NAME for part in parts) or sum(map(len, parts)) > LONGEST_PATH:
        return f"must be a path of at most {LONGEST_PATH} bytes, each name in it of at most {LONGEST_NAME}"
    return ""

"""Find out which command wrote a folder of results."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pairsim.runtime.errors import InputError

MARKS = {
    "sweep": ("sweep.json", "sweep-*-of-*.json"),
    "study": ("study.csv", "sweep-[0-9]*/grid.yaml"),
}
"""The files by which the folder of a command for many cases is recognised."""


def kind_of(directory: Path) -> str:
    """The command that wrote a folder.

    Raises:
        InputError: It is not a folder of results.
    """
    if not directory.exists():
        raise InputError(str(directory), "", None, "no such folder")
    if not directory.is_dir():
        raise InputError(
            str(directory), "", None, "must be a folder of results, such as runs/quickstart, but is a file"
        )
    for kind, patterns in MARKS.items():
        if any(path.is_file() for pattern in patterns for path in directory.glob(pattern)):
            return kind
    if isinstance(named := read_record(directory).get("kind"), str):
        return named
    held = "is empty" if not any(directory.iterdir()) else "has no run.json, sweep.json or study.csv"
    held = f"must be a folder of results, but {held}"
    inside = sorted({path.parent.name for path in directory.glob("*/run.json")})
    hint = (
        f"; there are results in its folders {', '.join(inside[:5])}{', ...' if len(inside) > 5 else ''}"
        if inside
        else ""
    )
    raise InputError(str(directory), "", None, held + hint)


def read_record(directory: Path) -> dict[str, Any]:
    """Read run.json of a folder; returns an empty dict if it is missing or invalid."""
    try:
        return valid_record(directory)
    except InputError:
        return {}


def valid_record(directory: Path) -> dict[str, Any]:
    """Read run.json of a folder.

    Raises:
        InputError: It is missing or invalid.
    """
    path = directory / "run.json"
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(str(path), "", None, f"cannot be read ({error})") from None
    if not isinstance(record, dict):
        raise InputError(str(path), "", None, "must be a JSON object")
    return record

"""Which command a folder of results belongs to."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

from pairsim.runtime.errors import InputError

Kind = Literal["run", "curve", "critical", "sweep", "study"]
MARKS: dict[Kind, tuple[str, ...]] = {
    "sweep": ("sweep.json", "sweep-*-of-*.json"),
    "study": ("study.csv", "sweep-[0-9]*/sweep.json"),
    "curve": ("curve.csv",),
    "critical": ("critical.csv",),
    "run": ("series.csv", "run.json"),
}
"""The files by which each is recognised, in the order in which they are looked for. run.json names the command of its
folder itself; one of an earlier version, alone, is that of any of three, which ended before its table was begun."""


def kind_of(directory: Path) -> Kind:
    """The command that wrote a folder.

    Raises:
        InputError: It is no folder, or none of pairsim's; the message says what it is.
    """
    if not directory.exists():
        raise InputError(str(directory), "", None, "no such folder")
    if not directory.is_dir():
        raise InputError(str(directory), "", None, "is a file; must be a folder of results, such as runs/quickstart")
    named = read_record(directory).get("kind")
    for kind, patterns in MARKS.items():
        if kind == named:
            return kind
        if any(path.is_file() for pattern in patterns for path in directory.glob(pattern)):
            return kind
    tables = "series.csv, curve.csv, critical.csv, sweep.json, study.csv"
    held = "is an empty folder" if not any(directory.iterdir()) else f"holds no results of pairsim: none of {tables}"
    inside = sorted({path.parent.name for path in directory.glob("*/run.json")})
    hint = f"; folders in it do: {', '.join(inside[:5])}{', ...' if len(inside) > 5 else ''}" if inside else ""
    raise InputError(str(directory), "", None, held + hint)


def read_record(directory: Path) -> dict[str, Any]:
    """run.json of a folder; empty if there is none or it is broken."""
    try:
        record = json.loads((directory / "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}

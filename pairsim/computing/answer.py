"""What the answers of all questions share: shapes, costs, and what to do next."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pairsim.results.columns import suffixes_in
from pairsim.runtime.errors import BranchEnd
from pairsim.runtime.text import duration

MOST_SHAPES = 4  # that are all told
CASE_NOT_AT_FAULT = ("interrupted", "write_failed", "environment")  # reasons for which the same command may succeed
LIMITS = ("wall_time", "max_steps")  # reasons that are keys of `limits` as well


def shapes_in(table: Mapping[str, Any], row: int, when: str) -> list[str]:
    """The Taylor parameters in a row."""
    values = {f"D{each}": float(table[f"D{each}"][row]) for each in suffixes_in(table, "D")}
    said = [f"{name} = {values[name]:.3g}" for name in sorted(values, key=lambda name: values[name])]
    shapes = (
        f"from {said[0]} to {said[-1]}"
        if len(said) > MOST_SHAPES
        else ", ".join(f"{name} = {value:.3g}" for name, value in values.items())
    )
    return [f"Taylor parameters{f' {when}' if when else ''}: {shapes}."] if shapes else []


def cost_line(record: Mapping[str, Any]) -> str:
    """Wall time and work of a command."""
    parts = [f"{record[key]} {what}" for key, what in (("steps", "steps"), ("points", "points")) if key in record]
    parts += [f"{record['unknowns']:,} unknowns"] if "unknowns" in record else []
    return f"Took {duration(float(record.get('wall_time', 0.0)))}" + (f" ({', '.join(parts)})." if parts else ".")


def advice(afterwards: str, status: str, reason: str, message: str, directory: Path, resumable: bool) -> str:
    """What to do next.

    Args:
        afterwards: What may come next where it has finished.
        status: How it ended, as in run.json.
        reason: Why.
        message: The same in words, with what a failure advises to try.
        directory: The folder of its results.
        resumable: Whether the command goes on from a checkpoint.
    """
    from pairsim.results.folder import WAY

    if reason == BranchEnd.reason:
        way, drawn = directory / WAY, "and fields.png the last shapes" if (directory / "fields.png").exists() else ""
        known = f"; {way} has the steady states on the way {drawn}".rstrip() if way.exists() else ""
        return f"Next: a smaller Ca_e or De{known}."
    if status == "finished":
        return f"Next: {afterwards}."
    if reason in LIMITS:
        return f"Next: pairsim run --resume {directory} --set limits.{reason}=... continues from the last checkpoint."
    if reason not in CASE_NOT_AT_FAULT:
        _, found, remedy = message.rpartition("; try ")
        change = f"try {remedy}; " if found else ""
        return f"Next: {change}unchanged, the case fails in the same way. What was written stands."
    if resumable:
        return f"Next: pairsim run --resume {directory} continues from the last checkpoint."
    return "Next: the same command with --overwrite computes it again; what was written stands until then."

"""Parse options of `pairsim sweep`, and format the output of `--dry-run`."""

from __future__ import annotations

import re
from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from pairsim.runtime.duration import duration
from pairsim.runtime.errors import InputError
from pairsim.sweeps.grid import Grid


def parse_time(text: str) -> float:
    """Parse a time in seconds, H:MM or H:MM:SS.

    Returns:
        The time in seconds.

    Raises:
        InputError: The text has another form.
    """
    if re.fullmatch(r"\d{1,9}(\.\d*)?", text) and float(text) > 0:
        return float(text)
    if match := re.fullmatch(r"(\d{1,6}):([0-5]?\d)(?::([0-5]?\d))?", text):
        hours, minutes, seconds = (int(part or 0) for part in match.groups())
        return 3600.0 * hours + 60 * minutes + seconds
    raise InputError("--walltime", "", text, "must be seconds, H:MM or H:MM:SS")


def parse_shard(text: str) -> tuple[int, int]:
    """Parse a shard `i/n` with 1 <= i <= n.

    Raises:
        InputError: The text has another form.
    """
    match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise InputError("--shard", "", text, "must be part/parts counted from 1, such as 2/8")
    return int(match[1]), int(match[2])


def shown(value: Any) -> str:
    """Format the value of a parameter."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def dry_run_view(grid: Grid, part: tuple[int, int] | None) -> Group:
    """The output of `--dry-run`: number of cases, and estimated unknowns and time of each."""
    total = sum(case.estimate.seconds for case in grid.cases)
    headline = f"{len(grid.cases)} cases of pairsim {grid.command.name}, about {duration(total)} on one core"
    notes = [
        f"{count} {what}"
        for count, what in ((grid.duplicates, "duplicates left out"), (grid.excluded, "excluded"))
        if count
    ]
    table = Table("folder", *grid.varying, "unknowns", "seconds", box=None, pad_edge=False)
    for case in grid.cases:
        estimate = case.estimate
        values = [shown(case.parameters[key]) for key in grid.varying]
        table.add_row(*map(Text, [case.folder, *values, f"~{estimate.unknowns}", f"~{estimate.seconds:.2g}"]))
    lines = [headline + (f" ({', '.join(notes)})" if notes else "")]
    lines += [f"part {part[0]} of {part[1]} would compute its share of them"] if part else []
    return Group(*map(Text, lines), table)

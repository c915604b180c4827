"""What `pairsim sweep --dry-run` shows."""

from __future__ import annotations

from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from pairsim.runtime.duration import duration
from pairsim.sweeps.grid import Grid
from pairsim.sweeps.options import Shard


def shown(value: Any) -> str:
    """Format the value of a parameter."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def dry_run_view(grid: Grid, part: Shard | None) -> Group:
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
    lines += [f"part {part.i} of {part.n} would compute its share of them"] if part else []
    return Group(*map(Text, lines), table)

"""What users see of a sweep: before it begins (--dry-run), while it is computed, and with `pairsim status`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from pairsim.runtime.text import counted
from pairsim.sweeps.folder import CaseState, SweepRecord, SweptCase
from pairsim.sweeps.grid import Grid

NUMBER = re.compile(r"[-+]?\d[\d.]*(e[-+]?\d+)?")  # warnings that differ only in numbers are of one kind
COLOURS = {"finished": "green", "failed": "red", "interrupted": "yellow", "running": "cyan"}
"""Colours of the statuses of cases."""


def headline(state: CaseState) -> str:
    """How a case has ended, in one line."""
    dU, seconds = state.values.get("dU"), state.values.get("wall_time")
    reason = f" ({state.reason})" if state.reason not in ("", "end") else ""
    shown = f"  dU = {dU:+.4e}" if isinstance(dU, float) else ""
    took = f"  {seconds:.1f} s" if isinstance(seconds, float) else ""
    message = f"  {state.message}" if state.status == "failed" else ""
    warnings = f"  {counted(len(state.warnings), 'warning')}" if state.warnings else ""
    return f"{state.status}{reason} {state.folder}{shown}{took}{warnings}{message}"


def summarised(cases: Sequence[SweptCase]) -> list[str]:
    """The warnings of the cases of a sweep, one of each kind: the first, its case, and how many more cases have it.

    Warnings that differ only in their numbers are of one kind.
    """
    kinds: dict[str, list[tuple[str, str]]] = {}
    for case in cases:
        for warning in case.state.warnings:
            kinds.setdefault(NUMBER.sub("...", warning), []).append((warning, case.folder))
    return [
        f"{held[0][0]} ({held[0][1]}{f' and {len(held) - 1} more' if len(held) > 1 else ''})" for held in kinds.values()
    ]


def status_view(sweep: SweepRecord, working: bool) -> Group:
    """The output of `pairsim status` for a sweep: the number of cases of each status, warnings, and failures.

    Args:
        sweep: The sweep, as returned by `read_sweep`.
        working: Whether a command is computing it now.
    """
    counts, cases = sweep.counts, sweep.cases
    shown = [Text(f"{count} {status}", style=COLOURS.get(status, "")) for status, count in counts.items() if count]
    title = f"{sweep.name}: {len(cases)} cases of pairsim {sweep.question.name}"
    parts: list[Any] = [Text(title, style="bold"), Text(", ").join(shown)]
    if counts["pending"] + counts["running"]:
        rest = "a sweep is at work" if working else "no sweep is at work here; the same command continues it"
        parts.append(Text(rest))
    parts += [Text(f"warning: {text}") for text in summarised(cases)]
    if failures := sweep.without_result:
        table = Table("case", "reason", "what happened", box=None, pad_edge=False)
        for case in failures:
            table.add_row(Text(case.folder), Text(case.state.reason), Text(case.state.message))
        parts.append(table)
    return Group(*parts)


def dry_run_view(grid: Grid) -> Group:
    """The output of `--dry-run`: number of cases, and the unknowns and the duration of each."""
    left_out = [f"{counted(grid.duplicates, 'duplicate')} left out"] if grid.duplicates else []
    notes = ", ".join([*left_out, *([f"{grid.excluded} excluded"] if grid.excluded else [])])
    table = Table("folder", *grid.varying, "unknowns", "takes", box=None, pad_edge=False)
    for case in grid.cases:
        values = (case.parameters[key] for key in grid.varying)
        shown = [f"{value:g}" if isinstance(value, float) else str(value) for value in values]
        estimate = grid.question.estimate(case.case)
        table.add_row(*map(Text, [case.folder, *shown, f"~{estimate.unknowns}", estimate.duration]))
    title = f"{len(grid.cases)} cases of pairsim {grid.question.name}" + (f" ({notes})" if notes else "")
    return Group(Text(title), table)

"""Compute every case of a grid; the same command continues an interrupted sweep.

Each case has its own folder, which records its state; results.csv has the main
results of all cases. Under mpirun or srun, the cases are distributed over
the processes.

Exit codes: 0 no case failed, 2 wrong input, 3 some cases failed, 4
installation or system at fault (pairsim doctor), 130 interrupted.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import pairsim
from pairsim.app.exit_codes import end
from pairsim.app.options import CaseTimeout, OutputOfMany, Quiet, Settings, Workers, print_table
from pairsim.runtime.launcher import rank
from pairsim.runtime.signals import Signals
from pairsim.runtime.text import pasteable

if TYPE_CHECKING:
    from pairsim.app.sweep_results import SweepResult

EXAMPLES = (
    "Examples: pairsim sweep grid.yaml --dry-run | pairsim sweep grid.yaml --workers 4 | "
    "mpirun -n 8 pairsim sweep grid.yaml -o out"
)


def sweep(
    grid: Annotated[Path, typer.Argument(help="Grid file (YAML): base, grid, zip, cases, exclude.")],
    folder: OutputOfMany = None,
    workers: Workers = 1,
    case_timeout: CaseTimeout = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only list the cases, with unknowns and times.")] = False,
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    settings = set_ or ()
    if dry_run:
        from pairsim.sweeps.grid import read_grid
        from pairsim.sweeps.progress import dry_run_view

        if rank() == 0:
            print_table(dry_run_view(read_grid(grid, settings)))
        return
    with Signals(final=True) as signals:
        result = pairsim.sweep(
            grid,
            folder=folder,
            workers=workers,
            case_timeout=case_timeout,
            progress=not quiet,
            signals=signals,
            settings=settings,
        )
    end(result.exit_code, result.message, result.folder, "" if quiet or rank() else _next(result))


def _next(result: SweepResult) -> str:
    """What can be done next with a sweep that has ended, in words."""
    table = f"pairsim table {pasteable(result.folder)} results has what was found in each case"
    drawn = result.record.question.in_sweeps.drawn
    return f"{table}; pairsim plot {pasteable(result.folder)} draws it" if drawn else table

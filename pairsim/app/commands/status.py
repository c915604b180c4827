"""Show the status of a folder of results.

For a sweep or study it shows the number of cases by status, and the reasons
of failures; for a case whether it is running or how it ended, wall time in
s, and warnings.
"""

from __future__ import annotations

import typer

import pairsim
from pairsim.app.options import Folder, print_table
from pairsim.record.folder import kind_of
from pairsim.runtime.locks import is_locked

EXAMPLES = "Examples: pairsim status runs/sweep | pairsim status runs/quickstart"


def status(directory: Folder) -> None:
    if kind_of(directory) in ("sweep", "study"):
        from pairsim.sweeps.folder import read_sweep
        from pairsim.sweeps.progress import status_view

        print_table(status_view(read_sweep(directory, values=False), is_locked(directory)))
    else:
        result = pairsim.open(directory)
        reason = f" ({result.reason})" if result.reason not in ("", result.status) else ""
        cost = f"{result.record.wall_time or 0.0:.3g} s of wall time, by: {result.record.command}"
        warnings = (f"warning: {warning}" for warning in result.warnings)
        after = result.advice if result.status not in ("finished", "running") else ""
        lines = (f"{directory}: {result.status}{reason}", result.happened, cost, *warnings, after)
        typer.echo("\n".join(filter(None, lines)))

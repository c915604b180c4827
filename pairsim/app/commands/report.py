"""Write DIR/report.html: answer, warnings, pictures, table and provenance on one page.

It is a single file that needs no network, for a case or a sweep, finished or
not. An existing one is replaced.
"""

from __future__ import annotations

import typer

import pairsim
from pairsim.app.options import Folder

EXAMPLES = "Examples: pairsim report runs/quickstart | pairsim report runs/sweep"


def report(directory: Folder) -> None:
    typer.echo(str(pairsim.report(directory)))

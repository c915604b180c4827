"""Write DIR/report.html: answer, warnings, pictures, table and provenance on one page.

One file that needs no network, to send around; of a case or a sweep, finished
or not. It is replaced where it exists.
"""

from __future__ import annotations

import typer

import pairsim
from pairsim.app.options import Folder

EXAMPLES = "Examples: pairsim report runs/quickstart | pairsim report runs/sweep"


def report(directory: Folder) -> None:
    typer.echo(str(pairsim.report(directory)))

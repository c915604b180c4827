"""Write a commented example to NAME.yaml; an existing file is never replaced."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pairsim.app.options import OfExamples
from pairsim.cases.example import write_example
from pairsim.runtime.text import pasteable

EXAMPLES = "Examples: pairsim init | pairsim init beads --kind curve"


def init(
    name: Annotated[str | None, typer.Argument(help="Name of the case and of its file (default: the kind).")] = None,
    kind: Annotated[OfExamples, typer.Option("--kind", help="The command that reads the file.")] = "run",
) -> None:
    path = write_example(kind, name or kind, Path())
    typer.echo(str(path))
    typer.echo(f"next: pairsim {kind} {pasteable(path)} --dry-run", err=True)

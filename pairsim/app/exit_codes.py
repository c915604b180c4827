"""How commands for many cases end."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import NoReturn

import typer

from pairsim.runtime.launcher import rank


def end(code: int, message: str, directory: Path, after: str = "") -> NoReturn:
    """Print how a sweep or study has ended and, if no case has failed, what comes next and its folder; then exit."""
    if rank() == 0:
        with suppress(OSError):  # a terminal that is gone changes no exit code
            typer.echo(message, err=True)
            if code == 0 and after:
                typer.echo(f"Next: {after}.", err=True)
        if code == 0:
            typer.echo(str(directory))
    raise typer.Exit(code)

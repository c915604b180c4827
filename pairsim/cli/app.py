"""The command line: all commands, and the end of the process.

Large libraries are imported inside the commands, so that --help and input errors are printed at once.
"""

from __future__ import annotations

import os
import sys
from typing import Annotated, NoReturn

import typer

from pairsim.cli import bench, cases, first_steps, pictures, sweeps
from pairsim.cli.options import rank
from pairsim.cli.streams import discard_stdout, repair_streams
from pairsim.runtime.errors import (
    ENVIRONMENT,
    EnvironmentFailure,
    InputError,
    PairsimError,
    RunFailure,
    abort_others,
    unexpected,
)
from pairsim.runtime.signals import no_interrupt_lost
from pairsim.runtime.version import __version__, commit

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Soft and rigid spheres on the axis of a tube: do they separate or collide, and how fast?",
    epilog="Example: pairsim run configs/quickstart.yaml",
)
app.add_typer(cases.app)
app.add_typer(sweeps.app)
app.add_typer(bench.app)
app.add_typer(first_steps.app)
app.add_typer(pictures.app)


def _version(wanted: bool) -> None:
    if wanted:
        made_from = commit()
        typer.echo(f"pairsim {__version__}" + (f" (commit {made_from})" if made_from else ""))
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and its commit.")
    ] = False,
) -> None:
    pass


@no_interrupt_lost()
def main() -> NoReturn:
    """Entry point: every `PairsimError` is printed as one message, without a traceback, and sets the exit code."""
    repair_streams()
    try:
        os.getcwd()
    except OSError:
        _complain(EnvironmentFailure("the current folder has been removed", advice="cd to another one"))
        sys.exit(ENVIRONMENT)
    try:
        app(standalone_mode=True)
    except InputError as error:
        _complain(error)
        sys.exit(2)
    except EnvironmentFailure as error:
        _complain(error)
        sys.exit(ENVIRONMENT)
    except RunFailure as error:
        _complain(error)
        sys.exit(3)
    except PairsimError as error:
        _complain(error)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    except OSError as error:
        named = error.filename or "standard output"
        _complain(EnvironmentFailure(f"{named} cannot be used ({error.strerror or error})"))
        discard_stdout()
        abort_others(ENVIRONMENT)
        sys.exit(ENVIRONMENT)
    except Exception:
        sys.exit(unexpected())
    sys.exit(0)


def _complain(error: Exception) -> None:
    """Print an error to stderr, on the first process only."""
    if rank() == 0:
        lines = str(error).splitlines()
        if isinstance(error, InputError) and len(error.mistakes) > 1:
            lines.insert(0, f"{len(error.mistakes)} mistakes:")
        name = "" if lines[0].startswith("pairsim ") else "pairsim: "  # a mistake in an option names the command
        typer.echo(name + "\n  ".join(lines), err=True)

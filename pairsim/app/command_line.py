"""The command line: all commands, and the end of the process."""

from __future__ import annotations

import atexit
import gc
import sys
import traceback
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup

from pairsim.app.made import made
from pairsim.physics.own_laws import name_file
from pairsim.questions.registry import FIRST_LINES
from pairsim.runtime.errors import EnvironmentFailure, InputError, PairsimError
from pairsim.runtime.interrupts import EXIT_CODE, interrupted
from pairsim.runtime.launcher import rank
from pairsim.runtime.version import __version__, commit

COMMANDS = Path(__file__).with_name("commands")
ORDER = (
    *("init", "schema", "mesh", "check-law", "doctor", "units", "ask", "fit", "sweep", "study", "atlas"),
    *("status", "table", "travel", "plot", "report", "moduli"),
)
"""The commands that are not those of questions, in the order of --help; others follow by name."""


def _first_lines() -> dict[str, str]:
    """The first line of the help of each command by its name."""
    found = dict[str, str]()
    for file in COMMANDS.glob("[a-z]*.py"):
        with file.open(encoding="utf-8") as lines:
            found[file.stem.replace("_", "-")] = lines.readline().lstrip("r").strip('"\n')
    order = (*(name for name in ORDER if name in found), *sorted(found.keys() - {*ORDER}))
    return {**FIRST_LINES, **{name: found[name] for name in order}}


def command_of(name: str) -> TyperCommand:
    """A command, from the record of its question or from its file, which is imported."""
    if name in FIRST_LINES:
        from pairsim.app.question_commands import command_of_question

        return command_of_question(name)
    file = import_module(f"{__package__}.commands.{name.replace('-', '_')}")
    return made(name, getattr(file, file.__name__.rpartition(".")[2]), str(file.__doc__), file.EXAMPLES)


class _OnDemand(TyperCommand):
    """A command whose file is imported when it is called; --help lists the first line of the file."""

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        return command_of(str(self.name)).make_context(info_name, args, parent, **extra)


class _All(TyperGroup):
    """All commands, those of questions first; --laws may stand anywhere."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = {name: _OnDemand(name, help=first) for name, first in _first_lines().items()}

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        own, others = list[str](), list[str]()
        rest = iter(args)
        for word in rest:
            if word == "--laws":
                own += [word, *islice(rest, 1)]
            else:
                (own if word.startswith("--laws=") else others).append(word)
        return super().parse_args(ctx, [*own, *others])


app = typer.Typer(
    cls=_All,
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Soft and rigid spheres on the axis of a tube: do they separate or collide, and how fast?",
    epilog="Example: pairsim run configs/quickstart.yaml",
)


def _version(wanted: bool) -> None:
    if wanted:
        made_from = commit()
        typer.echo(f"pairsim {__version__}" + (f" (commit {made_from})" if made_from else ""))
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_version, is_eager=True, help="Print the version and, of a release, its commit."
        ),
    ] = False,
    laws: Annotated[
        list[Path] | None,
        typer.Option(
            "--laws", metavar="FILE", help="Python file with laws of your own; may stand anywhere, and be repeated."
        ),
    ] = None,
) -> None:
    if laws:
        for file in laws:
            name_file(file)


def main() -> NoReturn:
    """Run a command: every `PairsimError` is printed as one message, without a traceback, and sets the exit code."""
    atexit.register(gc.freeze)  # or else Python collects garbage in all its objects when it ends
    try:
        app(standalone_mode=True)
    except KeyboardInterrupt:
        sys.exit(EXIT_CODE)
    except Exception as error:
        if interrupted():
            sys.exit(EXIT_CODE)
        _fail(error)
    sys.exit(0)


def _fail(error: Exception) -> NoReturn:
    """Say what is wrong, and end the process with the exit code that belongs to it."""
    if isinstance(error, PairsimError):
        _complain(error)
        sys.exit(error.exit_code)
    if isinstance(error, OSError):
        named = error.filename or "standard output"
        _complain(EnvironmentFailure(f"{named} cannot be used ({error.strerror or error})"))
        _abort(EnvironmentFailure.exit_code)
    traceback.print_exception(error)
    _abort(1)


def _abort(code: int) -> NoReturn:
    """End the process, and others of its MPI job, which would wait for this one."""
    mpi = sys.modules.get("mpi4py.MPI")
    if mpi is not None and mpi.COMM_WORLD.size > 1:
        mpi.COMM_WORLD.Abort(code)
    sys.exit(code)


def _complain(error: Exception) -> None:
    """Print an error to stderr, on the first process only."""
    if rank() == 0:
        lines = str(error).splitlines()
        if isinstance(error, InputError) and len(error.mistakes) > 1:
            lines.insert(0, f"{len(error.mistakes)} mistakes:")
        named = lines[0].startswith(("pairsim ", "pairsim:"))  # a mistake in an option names the command
        name = "" if named else "pairsim: "
        typer.echo(name + "\n  ".join(lines), err=True)

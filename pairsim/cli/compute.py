"""What the command of a question does: check a case, and show its cost, or compute it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from pairsim.cases.identity import default_folder
from pairsim.cli.options import Budget, CaseFile, DryRun, Output, Overwrite, Quiet, Settings
from pairsim.computing.case_files import read_case
from pairsim.results.folder import FIELDS_XDMF
from pairsim.runtime.errors import BranchEnd, EnvironmentFailure, InputError, RunFailure
from pairsim.runtime.launcher import check_single
from pairsim.runtime.signals import Signals

if TYPE_CHECKING:
    from pairsim.api.compute import Computation
    from pairsim.api.results import Result

EXIT_CODES = {"finished": 0, "failed": RunFailure.exit_code, "interrupted": 130}
"""Exit code of a command, by status."""
REASON_CODES = {kind.reason: kind.exit_code for kind in (EnvironmentFailure, BranchEnd)}
"""Exit codes of reasons that have their own."""


def app_of(computation: Computation[Any], words: str | None, epilog: str) -> typer.Typer:
    """The command of a question that has the options of all, with its help (`words`) and examples."""
    app = typer.Typer()

    @app.command(computation.question.name, help=words, epilog=epilog)
    def command(
        case: CaseFile,
        output: Output = None,
        overwrite: Overwrite = False,
        budget: Budget = None,
        dry_run: DryRun = False,
        quiet: Quiet = False,
        set_: Settings = None,
    ) -> None:
        compute(computation, case, output, overwrite, budget, dry_run, quiet, set_)

    return app


def compute(
    computation: Computation[Any],
    file: Path,
    folder: Path | None,
    overwrite: bool,
    budget: str | None,
    dry_run: bool,
    quiet: bool,
    settings: list[str] | None,
    **flags: bool,
) -> None:
    """Carry out the command of a question; arguments are those of its options, `flags` those that it alone has."""

    check_single()
    question = computation.question
    case = read_case(question, file, tuple(settings or ()))
    directory = folder or default_folder(question.name, case, file.stem)
    if dry_run:
        notes = (f"note: {note}" for note in (*case.remarks, *case.notes))
        typer.echo("\n".join([f"{directory}: {question.estimate(case)}", *notes]))
        return
    with Signals(final=True) as signals:
        result = computation(
            case, folder=directory, overwrite=overwrite, progress=not quiet, signals=signals, budget=budget, **flags
        )
        _end(result, directory, quiet)


def _end(result: Result, directory: Path, quiet: bool) -> NoReturn:
    """Draw, give the folder (stdout) and what to do next (stderr), and exit with the code of the outcome."""

    least, code = result.question.draws_from, REASON_CODES.get(result.reason, EXIT_CODES[result.status])
    drawn = least is not None and (result.columns.rows >= least or (directory / FIELDS_XDMF).exists())
    if result.status == "finished" and drawn:
        try:
            result.plot(directory)
        except InputError as error:
            typer.echo(f"warning: no picture: {error}; pairsim plot {directory} draws it", err=True)
    if code == 0:
        typer.echo(str(directory))
    with suppress(OSError):  # a terminal that is gone changes no exit code
        if quiet and code:
            typer.echo(result.message, err=True)
        elif not quiet and directory.is_dir() and result.status == "finished":  # else the answer has it
            typer.echo(result.advice, err=True)
    raise typer.Exit(code)

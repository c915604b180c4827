"""The commands of questions, made from their records: check a case, and show its cost, or compute it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from typer.core import TyperCommand

from pairsim.app.made import made
from pairsim.app.options import (
    Budget,
    CaseFile,
    CaseFileOrNone,
    DryRun,
    Output,
    Overwrite,
    Quiet,
    Settings,
    WorkersOfCase,
)
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import FIELDS_XDMF
from pairsim.runtime.errors import BranchEnd, EnvironmentFailure, InputError, RunFailure
from pairsim.runtime.interrupts import EXIT_CODE
from pairsim.runtime.launcher import check_single
from pairsim.runtime.signals import Signals
from pairsim.runtime.text import pasteable

if TYPE_CHECKING:
    from pairsim.computing.question import Flag, Question
    from pairsim.computing.result import Result

EXIT_CODES = {"finished": 0, "failed": RunFailure.exit_code, "interrupted": EXIT_CODE}
"""Exit code of a command, by status."""
REASON_CODES = {kind.reason: kind.exit_code for kind in (EnvironmentFailure, BranchEnd)}
"""Exit codes of reasons that have their own."""


def command_of_question(name: str) -> TyperCommand:
    """The command of a question: options that all have and its own, with help and examples from its record."""
    question = QUESTIONS[name]

    def command(**given: Any) -> None:
        flags = {flag: given.pop(flag.name) for flag in question.flags}
        _compute(question, flags, **given)

    command.__signature__ = Signature([*_parameters(question)])  # type: ignore[attr-defined]  # which typer reads
    return made(name, command, question.help, question.examples)


def _parameters(question: Question[Any]) -> Iterator[Parameter]:
    """The arguments and options of a question, as parameters of a function."""
    keyword = Parameter.KEYWORD_ONLY
    if question.resumable:
        yield Parameter("case", keyword, default=None, annotation=CaseFileOrNone)
    else:
        yield Parameter("case", keyword, annotation=CaseFile)
    yield Parameter("folder", keyword, default=None, annotation=Output)
    yield Parameter("overwrite", keyword, default=False, annotation=Overwrite)
    for flag in question.flags:
        option = f"--{flag.name.replace('_', '-')}"
        if flag.resumes:
            folder = Annotated[Path | None, typer.Option(option, metavar="DIR", help=flag.help)]
            yield Parameter(flag.name, keyword, default=None, annotation=folder)
        else:
            yield Parameter(
                flag.name, keyword, default=False, annotation=Annotated[bool, typer.Option(option, help=flag.help)]
            )
    yield Parameter("budget", keyword, default=None, annotation=Budget)
    if question.shared:
        yield Parameter("workers", keyword, default=1, annotation=WorkersOfCase)
    yield Parameter("dry_run", keyword, default=False, annotation=DryRun)
    yield Parameter("quiet", keyword, default=False, annotation=Quiet)
    yield Parameter("set_", keyword, default=None, annotation=Settings)


def _compute(
    question: Question[Any],
    flags: Mapping[Flag, Any],
    case: Path | None,
    folder: Path | None,
    overwrite: bool,
    budget: str | None,
    dry_run: bool,
    quiet: bool,
    set_: list[str] | None,
    workers: int = 1,
) -> None:
    """Carry out the command of a question; arguments are those of its options, `flags` those that it alone has."""
    from pairsim.app.question_functions import function_of
    from pairsim.cases.identity import default_folder
    from pairsim.computing.case_files import read_case
    from pairsim.sweeps.files import FILES

    file, place = _places(question, flags, case, folder, overwrite)
    check_single()
    checked = read_case(question, file, tuple(set_ or ()), FILES)
    directory = place or default_folder(question.name, checked, file.stem)
    if dry_run:
        notes = (f"note: {note}" for note in (*checked.remarks, *checked.notes))
        typer.echo("\n".join([f"{directory}: {question.estimate(checked)}", *notes]))
        return
    on: dict[str, Any] = {flag.name: bool(value) for flag, value in flags.items()}
    with Signals(final=True) as signals:
        result: Result = function_of(question.name)(
            checked,
            folder=directory,
            overwrite=overwrite,
            progress=not quiet,
            signals=signals,
            budget=budget,
            workers=workers,
            **on,
        )
        _end(result, directory, quiet)


def _places(
    question: Question[Any], flags: Mapping[Flag, Any], case: Path | None, output: Path | None, overwrite: bool
) -> tuple[Path, Path | None]:
    """The case file, and the folder for the results, if one is given; that of a resumed computation is its own."""
    for flag, folder in flags.items():
        if not flag.resumes:
            continue
        if folder is not None and (overwrite or output is not None):
            option = "--overwrite" if overwrite else "-o"
            allowed = f"must be left out with --{flag.name}, which names the folder"
            raise InputError(f"pairsim {question.name}", option, None, allowed)
        if case is None and folder is None:
            raise typer.BadParameter(f"must be given, or --{flag.name} DIR instead", param_hint="CASE")
        if folder is not None:
            return case or folder / "case.yaml", folder
    assert case is not None
    return case, output


def code_of(result: Result) -> int:
    """The exit code of a command whose result this is."""
    return REASON_CODES.get(result.reason, EXIT_CODES[result.status])


def draw(result: Result, directory: Path) -> None:
    """Draw the pictures of a result that has enough for them into its folder."""
    least = result.question.draws_from
    drawn = least is not None and (result.columns.rows >= least or (directory / FIELDS_XDMF).exists())
    if result.status == "finished" and drawn:
        try:
            result.plot(directory)
        except InputError as error:
            typer.echo(f"warning: no picture: {error}; pairsim plot {pasteable(directory)} draws it", err=True)


def _end(result: Result, directory: Path, quiet: bool) -> NoReturn:
    """Draw, give the folder (stdout) and what to do next (stderr), and exit with the code of the outcome."""
    code = code_of(result)
    draw(result, directory)
    if code == 0:
        typer.echo(str(directory))
    with suppress(OSError):  # a terminal that is gone changes no exit code
        if quiet and code:
            typer.echo(result.message, err=True)
        elif not quiet and directory.is_dir() and result.status == "finished":  # else the answer has the advice
            typer.echo(result.advice, err=True)
    raise typer.Exit(code)

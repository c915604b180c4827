"""The commands for one case, made from their records.

Large libraries are imported inside the commands, so that --help and input errors are printed at once.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from pairsim.cli.options import (
    Budget,
    CaseFile,
    DryRun,
    Output,
    Overwrite,
    OverwriteFile,
    Progress,
    Quiet,
    Settings,
    check_free,
    path_argument,
    path_option,
    rank,
)
from pairsim.commands import COMMANDS
from pairsim.runtime.errors import InputError
from pairsim.runtime.launcher import first_alone
from pairsim.runtime.signals import Signals

if TYPE_CHECKING:
    from pairsim.api.results import Result
    from pairsim.commands.command import Command
    from pairsim.drivers.progress import Style

app = typer.Typer(rich_markup_mode="rich")
CODES = {
    False: """Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.""",
    True: """Exit codes: 0 finished (also at contact or max_gap), 2 wrong input, 3
computation failed, 4 installation or system at fault (pairsim doctor), 130
interrupted.""",
}
"""The last paragraph of the help, by whether the command is one in time."""
MaybeCaseFile = Annotated[Path | None, path_argument("Case file (YAML); pairsim schema lists its keys.")]
Resume = Annotated[
    Path | None,
    path_option(
        "--resume",
        metavar="DIR",
        words="Continue the run in this folder from its checkpoint. "
        "A case file or --set may change name, time.end, limits and output.",
    ),
]


def of_record(name: str) -> typer.Typer:
    """The command of a record."""
    command = COMMANDS[name]
    alone = typer.Typer(rich_markup_mode="rich", add_completion=False)
    alone.command(name, epilog=f"Examples: {command.examples}")(_function(command))
    return alone


def _parameters(command: Command[Any]) -> list[Parameter]:
    """The arguments and options of a command, in the order of its help."""
    resumable = command.resumable
    found: dict[str, tuple[Any, Any]] = {
        "case": (MaybeCaseFile, None) if resumable else (CaseFile, Parameter.empty),
        "output": (Output, None),
        "overwrite": (Overwrite, False),
        **({"resume": (Resume, None)} if resumable else {}),
        **{
            each.name: (Annotated[bool, typer.Option(f"--{each.name}", help=each.help)], False)
            for each in command.flags
        },
        "budget": (Budget, None),
        "dry_run": (DryRun, False),
        "progress": (Progress, "auto"),
        "quiet": (Quiet, False),
        "set_": (Settings, None),
    }
    return [
        Parameter(name, Parameter.KEYWORD_ONLY, annotation=each[0], default=each[1]) for name, each in found.items()
    ]


def _function(command: Command[Any]) -> Callable[..., None]:
    """What a command does on the command line."""

    def function(**given: Any) -> None:
        _compute(command, given)

    parameters = _parameters(command)
    function.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    function.__annotations__ = {each.name: each.annotation for each in parameters}
    function.__doc__ = f"{command.about}\n\n{CODES[command.resumable]}"
    return function


def _compute(command: Command[Any], given: dict[str, Any]) -> None:
    """Check a case, and show its cost or compute it."""
    from pairsim.config.identity import default_folder
    from pairsim.inputs.case_files import read_case

    case, output, overwrite, resume = given["case"], given["output"], given["overwrite"], given.get("resume")
    if resume is not None and (overwrite or output is not None):
        option, allowed = "--overwrite" if overwrite else "-o", "must be left out with --resume, which gives the folder"
        raise InputError(f"pairsim {command.name}", option, None, allowed)
    if case is None:
        if resume is None:
            raise typer.BadParameter("must be given, or else --resume DIR", param_hint="CASE")
        case = resume / "case.yaml"
    checked = read_case(command, case, tuple(given["set_"] or ()))
    directory = resume or output or default_folder(command.name, checked, case.stem)
    if given["dry_run"]:
        if rank() == 0:
            notes = (f"note: {note}" for note in checked.notes)
            typer.echo("\n".join([f"{directory}: {command.estimate(checked)}", *notes]))
        return
    from pairsim.config.quantities import seconds_of

    with first_alone(lambda note: typer.echo(f"pairsim: note: {note}", err=True)):
        from pairsim.api.compute import compute

        shown: Style = "none" if given["quiet"] else given["progress"]
        more: dict[str, Any] = {flag.name: given[flag.name] for flag in command.flags}
        more |= {"resume": resume is not None} if command.resumable else {}
        with Signals(final=True):
            result = compute(command, checked, directory, overwrite, shown, True, seconds_of(given["budget"]), **more)
            _end(result, directory, shown)


def _end(result: Result, directory: Path, shown: Style) -> NoReturn:
    """Draw, give the folder (stdout) and what to do next (stderr), and exit with the code of the outcome."""
    from pairsim.commands.command import rows_in
    from pairsim.drivers.outcome import exit_code
    from pairsim.results.answer import advice
    from pairsim.results.output import FIELDS_XDMF

    command, code = result.command, exit_code(result.status, result.reason)
    rows, least = rows_in(result.columns), command.draws_from
    drawn = least is not None and (rows >= least or (directory / FIELDS_XDMF).exists())
    if result.status == "finished" and drawn:
        try:
            result.plot(directory)
        except InputError as error:
            typer.echo(f"warning: no picture: {error}; pairsim plot {directory} draws it", err=True)
    if code == 0:
        typer.echo(str(directory))
    if shown == "none" and code:
        typer.echo(result.message, err=True)
    elif shown not in ("none", "json") and directory.is_dir():
        afterwards = command.afterwards(directory, rows > 1 and "dU" in result.columns)
        ended = result.status, result.reason, result.message
        typer.echo(advice(afterwards, *ended, directory, command.resumable), err=True)
    raise typer.Exit(code)


@app.command(epilog="Example: pairsim mesh configs/quickstart.yaml -o meshes/pair.msh --png meshes/pair.png")
def mesh(
    case: CaseFile,
    output: Annotated[Path, path_option("-o", "--output", words="Mesh file: .msh (gmsh), .vtu or .xdmf.")],
    png: Annotated[Path | None, path_option("--png", words="Picture of the mesh around the particles.")] = None,
    overwrite: OverwriteFile = False,
    set_: Settings = None,
) -> None:
    """Write the mesh with which a run of a case begins.

    Lengths are in tube diameters D_c. Prints the numbers of cells, nodes and
    arcs.
    """
    from pairsim.inputs.case_files import read_case

    checked = read_case(COMMANDS["run"], case, tuple(set_ or ()))
    check_free(output, overwrite)
    check_free(png, overwrite, "--png")
    if output.suffix not in (".msh", ".vtu", ".xdmf"):
        raise InputError(str(output), "-o", output.suffix, "must be a name ending in .msh, .vtu or .xdmf")

    from pairsim.drivers.mesh import write_mesh

    for name, count in write_mesh(checked, output, png).items():
        typer.echo(f"{name}: {count}")

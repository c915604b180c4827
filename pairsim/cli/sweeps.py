"""Commands for many cases.

Large libraries are imported inside the commands, so that --help and input errors are printed at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import Field, fields
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, get_type_hints

import typer

from pairsim.cli.options import Progress, Quiet, Settings, print_table, rank
from pairsim.runtime.errors import InputError
from pairsim.runtime.signals import Signals
from pairsim.sweeps.options import Options

if TYPE_CHECKING:
    from pairsim.drivers.progress import Style

app = typer.Typer()

Output = Annotated[Path | None, typer.Option("-o", "--output", help="Folder for the results (default: runs/<name>).")]


def _path(about: str) -> Any:
    return typer.Argument(help=about, show_default=False)


def _parameter(option: Field[Any]) -> Parameter:
    """A field of `Options` as an option of the command line."""
    told = dict(option.metadata)
    parse = told.pop("parse", None)
    kind: Any = get_type_hints(Options)[option.name]
    if parse is not None:
        kind, told["callback"] = str | None, lambda text: parse(text) if text else None
    names = [f"--{option.name.replace('_', '-')}"] if kind is bool else []  # no --no-...
    annotation = Annotated[kind, typer.Option(*names, **told)]
    return Parameter(option.name, Parameter.KEYWORD_ONLY, default=option.default, annotation=annotation)


def _with_options(*left_out: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options of a sweep, without some; its function takes them as keywords."""

    def decorated(function: Callable[..., None]) -> Callable[..., None]:
        given = signature(function, eval_str=True)
        own = [each for each in given.parameters.values() if each.kind is not Parameter.VAR_KEYWORD]
        shown = [each for each in fields(Options) if each.metadata and each.name not in left_out]
        own[-3:-3] = map(_parameter, shown)  # before those of progress
        parameters = [each.replace(kind=Parameter.KEYWORD_ONLY) for each in own]
        function.__signature__ = given.replace(parameters=parameters)  # type: ignore[attr-defined]
        function.__annotations__ = {each.name: each.annotation for each in parameters}
        return function

    return decorated


@app.command(
    epilog="Examples: pairsim sweep grid.yaml --dry-run | mpirun -n 8 pairsim sweep grid.yaml -o out | "
    "pairsim sweep grid.yaml -o out --only-failed | pairsim sweep grid.yaml --emit slurm > job.sh"
)
@_with_options()
def sweep(
    grid: Annotated[Path, _path("Grid file (YAML): base, grid, zip, cases, exclude.")],
    output: Output = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="List the cases with estimated unknowns and time; compute nothing.")
    ] = False,
    emit: Annotated[
        str | None,
        typer.Option(
            metavar="slurm",
            help="Print a script for a Slurm job array, with time and memory from the cost estimate; compute nothing.",
        ),
    ] = None,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
    **given: Any,
) -> None:
    """Compute every case of a grid; the same command continues an interrupted sweep.

    Each case has its own folder; results.csv has the main results of all cases,
    sweep.json their status. Under mpirun or srun, the cases are distributed over
    the processes.

    Exit codes: 0 no case failed, 2 wrong input, 3 some cases failed or the disk
    is full, 4 installation or system at fault (pairsim doctor), 130 interrupted.
    """
    from pairsim.sweeps.grid import read_grid

    options = Options(**given, settings=tuple(set_ or ()))
    checked = read_grid(grid, options.settings)
    directory = output or Path("runs") / checked.name
    if emit is not None:
        from pairsim.sweeps.slurm import job_script

        if emit != "slurm":
            raise InputError("--emit", "", emit, "must be slurm")
        script, warnings = job_script(checked, directory, options)
        typer.echo(script, nl=False)
        for warning in warnings:
            typer.echo(f"warning: {warning}", err=True)
        return
    if dry_run:
        from pairsim.sweeps.progress import dry_run_view

        if rank() == 0:
            print_table(dry_run_view(checked, options.shard))
        return

    from pairsim.sweeps.sweep import run_sweep

    _compute(run_sweep, checked, directory, options, progress, quiet)


def _compute(
    run: Callable[..., tuple[int, str]], checked: Any, directory: Path, options: Options, progress: Style, quiet: bool
) -> NoReturn:
    """Compute a sweep or study, print the folder or the failure, and exit."""
    from pairsim.drivers.progress import make_reporter
    from pairsim.runtime.launcher import launcher_communicator

    comm = launcher_communicator()
    reporter = make_reporter("none" if quiet else progress, comm.rank if comm else 0)
    with Signals(final=True):
        code, message = run(checked, directory, options, comm, reporter)
        if message and code == 0:  # on the first process
            typer.echo(str(directory))
        elif message and quiet:
            typer.echo(message, err=True)
        raise typer.Exit(code)


@app.command(
    epilog="Examples: pairsim study configs/study.yaml | mpirun -n 2 pairsim study configs/study.yaml -o mesh-study"
)
@_with_options("limit", "only_failed", "fail_fast", "shard", "workers", "cold", "walltime")
def study(
    file: Annotated[Path, _path("Study file (YAML): base, at, discretisations, exact or reference, repeat.")],
    output: Output = None,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
    **given: Any,
) -> None:
    """Compute one case with several meshes and time steps, and compare errors and wall times.

    Writes study.csv and study.png. As for a sweep, the same command continues an
    interrupted study, and mpirun distributes the cases over the processes.

    Exit codes: 0 no case failed, 2 wrong input, 3 some cases failed or the disk
    is full, 4 installation or system at fault (pairsim doctor), 130 interrupted.
    """
    from pairsim.sweeps.study import read_study, run_study
    from pairsim.sweeps.sweep import run_sweep

    def run(_: Any, directory: Path, *how: Any) -> tuple[int, str]:
        return run_study(keys, grids, directory, lambda grid, folder: run_sweep(grid, folder, *how))

    keys, grids = read_study(file, tuple(set_ or ()))
    directory = output or Path("runs") / grids[0].name
    _compute(run, None, directory, Options(**given, cold=True), progress, quiet)


@app.command(epilog="Examples: pairsim status runs/sweep | pairsim status runs/quickstart")
def status(directory: Annotated[Path, _path("Folder of results.")]) -> None:
    """Show the status of a folder of results.

    sweep, study: number of cases by status, rate, time left, and the reasons of
    failures. run, curve, critical: whether it is running or how it ended, wall
    time in s, and warnings.
    """
    from rich.console import Group

    from pairsim.results.folders import kind_of
    from pairsim.results.standing import standing_view
    from pairsim.runtime.locks import is_locked
    from pairsim.sweeps.ledger import read_sweep
    from pairsim.sweeps.progress import status_view

    kind, working = kind_of(directory), is_locked(directory)
    if kind in ("sweep", "study"):
        inner = sorted(path.parent for path in directory.glob("*/sweep.json"))
        sweeps = [directory] if kind == "sweep" else inner
        print_table(Group(*(status_view(read_sweep(sweep), working) for sweep in sweeps)))
    else:
        print_table(standing_view(directory, working))

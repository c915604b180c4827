"""Commands for many cases.

Large libraries are imported inside the commands, so that --help and input errors are printed at once.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from pairsim.cli.options import Progress, Quiet, Settings, print_table, rank, usable
from pairsim.runtime.errors import InputError
from pairsim.runtime.signals import Signals

app = typer.Typer()

CLEAR = "\x1b[2J\x1b[H"  # clears a terminal


@app.command(
    epilog="Examples: pairsim sweep grid.yaml --dry-run | mpirun -n 8 pairsim sweep grid.yaml -o out | "
    "pairsim sweep grid.yaml -o out --only-failed | pairsim sweep grid.yaml --emit slurm > job.sh"
)
def sweep(
    grid: Annotated[
        Path,
        typer.Argument(
            help="Grid file (YAML): base, grid, zip, cases, exclude.",
            show_default=False,
            callback=usable,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Folder for the sweep (default: runs/<name>).",
            callback=usable,
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="List the cases with estimated unknowns and time; compute nothing.")
    ] = False,
    limit: Annotated[int | None, typer.Option(min=1, help="Largest number of cases to start.")] = None,
    only_failed: Annotated[
        bool, typer.Option("--only-failed", help="Repeat only the cases that failed or timed out.")
    ] = False,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop when a case fails.")] = False,
    shard: Annotated[str | None, typer.Option(metavar="I/N", help="Compute part I of N, counted from 1.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Number of cases computed at the same time, without mpirun.")] = 1,
    cold: Annotated[
        bool, typer.Option("--cold", help="A process of its own for every case, with nothing of another's.")
    ] = False,
    case_timeout: Annotated[
        float | None, typer.Option(min=0.0, help="Largest wall time of a case, in seconds.")
    ] = None,
    walltime: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help="Largest wall time of the sweep, in seconds or H:MM:SS; running cases are stopped in order before.",
        ),
    ] = None,
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
) -> None:
    """Compute every case of a grid; the same command continues an interrupted sweep.

    Each case has its own folder; results.csv has the main results of all cases,
    sweep.json their status. Under mpirun or srun, the cases are distributed over
    the processes.

    Exit codes: 0 no case failed, 2 wrong input, 3 some cases failed or the disk
    is full, 4 installation or system at fault (pairsim doctor), 130 interrupted.
    """
    from pairsim.sweeps.grid import read_grid
    from pairsim.sweeps.summary import dry_run_view, parse_shard, parse_time

    part = parse_shard(shard) if shard else None
    seconds = parse_time(walltime) if walltime else None
    checked = read_grid(grid, tuple(set_ or ()))
    directory = output or Path("runs") / checked.name
    if emit is not None:
        from pairsim.sweeps.slurm import job_script

        if emit != "slurm":
            raise InputError("--emit", "", emit, "must be slurm")
        extra = [word for setting in set_ or () for word in ("--set", setting)]
        extra += ["--cold"] if cold else []
        extra += ["--case-timeout", f"{case_timeout:g}"] if case_timeout else []
        tasks = part[1] if part else None
        script, warnings = job_script(checked, directory, tasks=tasks, walltime=seconds, extra=extra)
        typer.echo(script, nl=False)
        for warning in warnings:
            typer.echo(f"warning: {warning}", err=True)
        return
    if dry_run:
        if rank() == 0:
            print_table(dry_run_view(checked, part))
        return

    from pairsim.drivers.progress import make_reporter
    from pairsim.runtime.launcher import launcher_communicator
    from pairsim.sweeps.ledger import Shard
    from pairsim.sweeps.sweep import Options, run_sweep

    comm = launcher_communicator()
    options = Options(
        limit,
        only_failed,
        fail_fast,
        Shard(*part) if part else None,
        case_timeout,
        seconds,
        cold,
        tuple(set_ or ()),
        workers,
    )
    reporter = make_reporter("none" if quiet else progress, comm.rank if comm else 0)
    with Signals(final=True):
        code, message = run_sweep(checked, directory, options, comm, reporter)
        _end_sweep(code, message, directory, quiet)


def _end_sweep(code: int, message: str, directory: Path, quiet: bool) -> NoReturn:
    """Print the folder or the failure, and exit; `message` is empty on all processes but the first."""
    if message:
        if code == 0:
            typer.echo(str(directory))
        elif quiet:
            typer.echo(message, err=True)
    raise typer.Exit(code)


@app.command(
    epilog="Examples: pairsim study configs/study.yaml | mpirun -n 2 pairsim study configs/study.yaml -o mesh-study"
)
def study(
    file: Annotated[
        Path,
        typer.Argument(
            help="Study file (YAML): base, discretisations, quantity, over, at, exact or reference, repeat.",
            show_default=False,
            callback=usable,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Folder for the study (default: runs/<name>).",
            callback=usable,
        ),
    ] = None,
    case_timeout: Annotated[
        float | None, typer.Option(min=0.0, help="Largest wall time of a case, in seconds.")
    ] = None,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Compute one case with several meshes and time steps, and compare errors and wall times.

    Writes study.csv and study.png. As for a sweep, the same command continues an
    interrupted study, and mpirun distributes the cases over the processes.

    Exit codes: 0 no case failed, 2 wrong input, 3 some cases failed or the disk
    is full, 4 installation or system at fault (pairsim doctor), 130 interrupted.
    """
    from pairsim.config.yaml_file import read_yaml
    from pairsim.drivers.progress import make_reporter
    from pairsim.runtime.launcher import launcher_communicator
    from pairsim.sweeps.study import run_study
    from pairsim.sweeps.study_file import read_study

    checked = read_study(file, read_yaml(file), tuple(set_ or ()))
    directory = output or Path("runs") / checked.name
    comm = launcher_communicator()
    reporter = make_reporter("none" if quiet else progress, comm.rank if comm else 0)
    with Signals(final=True):
        code, message = run_study(checked, directory, case_timeout, comm, reporter)
        _end_sweep(code, message, directory, quiet)


@app.command(epilog="Examples: pairsim status runs/sweep | pairsim status out --watch | pairsim status runs/quickstart")
def status(
    directory: Annotated[
        Path,
        typer.Argument(
            help="Folder of results.",
            show_default=False,
            callback=usable,
        ),
    ],
    watch: Annotated[bool, typer.Option("--watch", help="Repeat every two seconds until the command ends.")] = False,
) -> None:
    """Show the status of a folder of results.

    sweep, study: number of cases by status, rate, time left, and the reasons of
    failures. run, curve, critical: whether it is running or how it ended, wall
    time in s, and warnings.
    """
    import time

    from pairsim.results.folders import kind_of
    from pairsim.runtime.locks import is_locked

    kind = kind_of(directory)
    while True:
        working = is_locked(directory)
        view = _status_view(directory, kind, working)
        if watch and sys.stdout.isatty():
            typer.echo(CLEAR, nl=False)
        print_table(view)
        if not watch or not working:
            return
        time.sleep(2)


def _status_view(directory: Path, kind: str, working: bool) -> object:
    """The output of `status` for a folder."""
    from pairsim.results.standing import standing_view
    from pairsim.sweeps.ledger import read_sweep
    from pairsim.sweeps.progress import status_view

    if kind == "sweep":
        return status_view(read_sweep(directory), working)
    if kind == "study":
        from rich.console import Group

        sweeps = sorted(path.parent for path in directory.glob("*/sweep.json"))
        return Group(*(status_view(read_sweep(sweep), working) for sweep in sweeps))
    return standing_view(directory, working)

"""The commands for many cases; everything heavy is imported inside them."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from pairsim.cli.options import Progress, Quiet, Settings, print_table, rank
from pairsim.runtime.errors import InputError

app = typer.Typer()

CLEAR = "\x1b[2J\x1b[H"  # a terminal's


@app.command(
    epilog="Examples: pairsim sweep grid.yaml --dry-run | mpirun -n 8 pairsim sweep grid.yaml -o out | "
    "pairsim sweep grid.yaml -o out --only-failed | pairsim sweep grid.yaml --emit slurm > job.sh"
)
def sweep(
    grid: Annotated[
        Path, typer.Argument(help="Grid file (YAML): base, grid, zip, cases, exclude.", show_default=False)
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder of the sweep (default: runs/<name>).")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="List the cases, unknowns and cost; compute none.")
    ] = False,
    limit: Annotated[int | None, typer.Option(min=1, help="Start so many cases at most.")] = None,
    only_failed: Annotated[bool, typer.Option("--only-failed", help="Repeat what failed or timed out.")] = False,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop when a case fails.")] = False,
    shard: Annotated[str | None, typer.Option(metavar="I/N", help="Do part I of N, counted from 1.")] = None,
    ranks_per_case: Annotated[int, typer.Option(min=1, help="MPI processes of each case.")] = 1,
    workers: Annotated[int, typer.Option(min=1, help="Cases at the same time, without mpirun.")] = 1,
    cold: Annotated[bool, typer.Option("--cold", help="Start no curve from its neighbour's solutions.")] = False,
    case_timeout: Annotated[float | None, typer.Option(min=0.0, help="Wall time of a case, in seconds.")] = None,
    walltime: Annotated[
        str | None, typer.Option(metavar="TIME", help="Stop in order before this has passed: seconds or H:MM:SS.")
    ] = None,
    emit: Annotated[
        str | None, typer.Option(metavar="slurm", help="Print a job-array script; compute nothing.")
    ] = None,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Run every case of a grid, also under mpirun or srun; the same command continues what was stopped.

    Every case gets a folder of its own; results.csv and sweep.json hold the table and how all cases stand.
    Exit code 0: no case failed; 2: bad grid; 3: some failed, or the disk is full; 130: interrupted.
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
        typer.echo(
            job_script(checked, directory, tasks=tasks, ranks_per_case=ranks_per_case, walltime=seconds, extra=extra),
            nl=False,
        )
        return
    if dry_run:
        if rank() == 0:
            print_table(dry_run_view(checked, part))
        return

    from pairsim.runtime.launcher import launcher_communicator
    from pairsim.sweeps.ledger import Shard
    from pairsim.sweeps.progress import make_sweep_reporter
    from pairsim.sweeps.sweep import Options, run_sweep

    comm = launcher_communicator()
    options = Options(
        limit,
        only_failed,
        fail_fast,
        Shard(*part) if part else None,
        ranks_per_case,
        case_timeout,
        seconds,
        cold,
        tuple(set_ or ()),
        workers,
    )
    reporter = make_sweep_reporter("none" if quiet else progress, comm.rank if comm else 0)
    code, message = run_sweep(checked, directory, options, comm, reporter)
    _end_sweep(code, message, directory, quiet)


def _end_sweep(code: int, message: str, directory: Path, quiet: bool) -> NoReturn:
    """Say where the results are or what went wrong (only the first process has a message), and exit."""
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
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder of the study (default: runs/<name>).")
    ] = None,
    case_timeout: Annotated[float | None, typer.Option(min=0.0, help="Wall time of a case, in seconds.")] = None,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Solve one case in many discretisations: what each costs, and how far off it is. study.csv, study.png.

    Works as a sweep: also under mpirun, and the same command continues what was stopped. Exit codes as those of sweep.
    """
    from pairsim.config.yaml_file import read_yaml
    from pairsim.runtime.launcher import launcher_communicator
    from pairsim.sweeps.progress import make_sweep_reporter
    from pairsim.sweeps.study import run_study
    from pairsim.sweeps.study_file import read_study

    checked = read_study(file, read_yaml(file), tuple(set_ or ()))
    directory = output or Path("runs") / checked.name
    comm = launcher_communicator()
    reporter = make_sweep_reporter("none" if quiet else progress, comm.rank if comm else 0)
    code, message = run_study(checked, directory, case_timeout, comm, reporter)
    _end_sweep(code, message, directory, quiet)


@app.command(epilog="Examples: pairsim status runs/sweep | pairsim status out --watch | pairsim status runs/quickstart")
def status(
    directory: Annotated[Path, typer.Argument(help="Folder of results.", show_default=False)],
    watch: Annotated[bool, typer.Option("--watch", help="Repeat every two seconds until the command ends.")] = False,
) -> None:
    """Tell how a folder of results stands.

    Of a sweep or study: counts, rate, time left, and what failed for which reason. Of a run, curve or critical: how it
    ended, or that it is at work, and its warnings.
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
    """What `status` shows of a folder of some kind."""
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

"""The commands; everything heavy is imported inside them, so that --help and input errors are immediate."""

from __future__ import annotations

import os
import shlex
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn

import typer

from pairsim import __version__
from pairsim.errors import InputError, PairsimError, RunFailure

if TYPE_CHECKING:
    from pairsim.record import Outcome

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Soft and rigid spheres on the axis of a tube: do they separate or collide, and how fast?",
    epilog="Example: pairsim run configs/quickstart.yaml",
)

CLEAR = "\x1b[2J\x1b[H"  # a terminal's

CaseFile = Annotated[Path, typer.Argument(help="Case file (YAML); pairsim schema lists its keys.", show_default=False)]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Replace a key, such as mesh.Np=20.")
]


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"pairsim {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print it.")] = False,
) -> None:
    pass


Output = Annotated[Path | None, typer.Option("-o", "--output", help="Folder of the results. [default: runs/<name>]")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace the results in an existing folder.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")]


@app.command(
    epilog="Examples: pairsim run configs/quickstart.yaml | pairsim run case.yaml -o out --set Ca_e=0.05 | "
    "mpirun -n 2 pairsim run case.yaml | pairsim run --resume out --set time.end=4"
)
def run(
    case: Annotated[
        Path | None, typer.Argument(help="Case file (YAML); pairsim schema lists its keys.", show_default=False)
    ] = None,
    output: Output = None,
    overwrite: Overwrite = False,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Go on with the run in this folder from its checkpoint. "
            "A case file or --set may change time.end, limits and output.",
            show_default=False,
        ),
    ] = None,
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Run one case in time: series.csv, fields.xdmf, case.yaml, run.json and checkpoint.npz.

    Exit code 0: finished (also at contact and max_gap); 2: bad input; 3: a typed failure; 130: interrupted.
    """
    from pairsim.case_file import load_case

    if resume is not None and (overwrite or output is not None):
        option = "--overwrite" if overwrite else "-o"
        raise InputError("pairsim run", option, None, "does not go with --resume, which names the folder")
    if case is None:
        if resume is None:
            raise typer.BadParameter("missing; give a case file, or --resume DIR", param_hint="CASE")
        case = resume / "case.yaml"
    checked = load_case(case, tuple(set_ or ()))
    directory = resume or output or Path("runs") / checked.slug
    common = _common_arguments(overwrite, quiet)
    from pairsim.run import run_case

    _end(run_case(checked, directory, resume=resume is not None, **common), directory, quiet, None)


@app.command(
    epilog="Examples: pairsim curve configs/curve.yaml | pairsim curve case.yaml -o out --sensitivities "
    "--set 'd={start: 0.02, stop: 1, num: 12}'"
)
def curve(
    case: CaseFile,
    output: Output = None,
    overwrite: Overwrite = False,
    sensitivities: Annotated[
        bool, typer.Option("--sensitivities", help="Add the derivatives of dU by Ca_e, De and beta at the same d.")
    ] = False,
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Solve the quasi-steady master curve dU(d) and its zeros: curve.csv, equilibria.csv, curve.png, run.json.

    The case file has d (a list, or {start, stop, num, spacing}) in place of d0. Exit codes as those of run.
    """
    from pairsim.case_file import load_curve

    checked = load_curve(case, tuple(set_ or ()))
    directory = output or Path("runs") / checked.slug
    common = _common_arguments(overwrite, quiet)
    from pairsim.curve_plots import plot_curve
    from pairsim.curve_run import run_curve

    outcome = run_curve(checked, directory, sensitivities=sensitivities, **common)
    _end(outcome, directory, quiet, plot_curve)


@app.command(
    epilog="Examples: pairsim critical configs/critical.yaml | "
    "pairsim critical case.yaml --set 'along={Ca_e: [0.02, 0.05, 0.1]}'"
)
def critical(
    case: CaseFile, output: Output = None, overwrite: Overwrite = False, quiet: Quiet = False, set_: Settings = None
) -> None:
    """Find the distances at which a pair neither separates nor collides, and follow them: critical.csv, critical.png.

    The case file has along: {Ca_e: ...} or {De: ...} (values, or {start, stop, num, spacing}), perhaps lines: with the
    other of the two, and d: [least, most], the distances that are looked at. Exit codes as those of run.
    """
    from pairsim.case_file import load_critical

    checked = load_critical(case, tuple(set_ or ()))
    directory = output or Path("runs") / checked.slug
    common = _common_arguments(overwrite, quiet)
    from pairsim.critical_plots import plot_critical
    from pairsim.critical_run import run_critical

    _end(run_critical(checked, directory, **common), directory, quiet, plot_critical)


def _common_arguments(overwrite: bool, quiet: bool) -> dict[str, Any]:
    """What every command that computes is called with."""
    from mpi4py import MPI

    import pairsim.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
    from pairsim.progress import make_reporter

    comm = MPI.COMM_WORLD
    command = shlex.join(["pairsim", *sys.argv[1:]])
    return {"comm": comm, "overwrite": overwrite, "reporter": make_reporter(quiet, comm.rank), "command": command}


def _end(outcome: Outcome, directory: Path, quiet: bool, plot: Callable[[Path, Path], list[Path]] | None) -> NoReturn:
    """Draw, say where the results are or what went wrong, and exit with the outcome's code."""
    from mpi4py import MPI

    if MPI.COMM_WORLD.rank == 0:
        if outcome.exit_code == 0:
            if plot is not None:
                plot(directory, directory)
            typer.echo(str(directory))
        elif quiet:
            typer.echo(outcome.message, err=True)
    raise typer.Exit(outcome.exit_code)


@app.command(epilog="Example: pairsim mesh configs/quickstart.yaml -o meshes/pair.msh --png meshes/pair.png")
def mesh(
    case: CaseFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="Mesh file for gmsh and meshio.")],
    png: Annotated[Path | None, typer.Option("--png", help="Picture of the mesh around the particles.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
    set_: Settings = None,
) -> None:
    """Make the reference mesh of a case and write it."""
    from pairsim.case_file import load_case

    checked = load_case(case, tuple(set_ or ()))
    for option, path in (("-o", output), ("--png", png)):
        if path is not None and path.exists() and not overwrite:
            raise InputError(str(path), option, None, "the file exists; use --overwrite or another name")
    if output.suffix not in (".msh", ".vtu", ".xdmf"):
        raise InputError(str(output), "-o", output.suffix, "a name ending in .msh, .vtu or .xdmf")

    from pairsim.mesh_files import write_mesh

    for name, count in write_mesh(checked, output, png).items():
        typer.echo(f"{name}: {count}")


@app.command(
    epilog="Examples: pairsim sweep grid.yaml --dry-run | mpirun -n 8 pairsim sweep grid.yaml -o study | "
    "pairsim sweep grid.yaml -o study --only-failed | pairsim sweep grid.yaml --emit slurm > job.sh"
)
def sweep(
    grid: Annotated[
        Path, typer.Argument(help="Grid file (YAML): base, grid, zip, cases, exclude.", show_default=False)
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder of the sweep. [default: runs/<name>]")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="List the cases, unknowns and cost; compute none.")
    ] = False,
    limit: Annotated[int | None, typer.Option(min=1, help="Start so many cases at most.")] = None,
    only_failed: Annotated[bool, typer.Option("--only-failed", help="Repeat what failed or timed out.")] = False,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop when a case fails.")] = False,
    shard: Annotated[str | None, typer.Option(metavar="I/N", help="Do part I of N, counted from 1.")] = None,
    ranks_per_case: Annotated[int, typer.Option(min=1, help="MPI processes of each case.")] = 1,
    cold: Annotated[bool, typer.Option("--cold", help="Start no curve from its neighbour's solutions.")] = False,
    case_timeout: Annotated[float | None, typer.Option(min=0.0, help="Wall time of a case, in seconds.")] = None,
    walltime: Annotated[
        str | None, typer.Option(metavar="TIME", help="Stop in order before this has passed: seconds or H:MM:SS.")
    ] = None,
    emit: Annotated[
        str | None, typer.Option(metavar="slurm", help="Print a job-array script; compute nothing.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
    set_: Settings = None,
) -> None:
    """Run every case of a grid, also under mpirun or srun; the same command continues what was stopped.

    Every case gets a folder of its own; results.csv and sweep.json hold the table and how all cases stand.
    Exit code 0: no case failed; 2: bad grid; 3: some failed, or the disk is full; 130: interrupted.
    """
    from pairsim.grid import read_grid
    from pairsim.sweep_text import dry_run_view, parse_shard, parse_time

    part = parse_shard(shard) if shard else None
    seconds = parse_time(walltime) if walltime else None
    checked = read_grid(grid, tuple(set_ or ()))
    directory = output or Path("runs") / checked.name
    if emit is not None:
        from pairsim.slurm import job_script

        if emit != "slurm":
            raise InputError("--emit", "", emit, "slurm")
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
        if _rank() == 0:
            _print(dry_run_view(checked, part))
        return

    from pairsim.ledger import Shard
    from pairsim.sweep import Options, launcher_communicator, run_sweep
    from pairsim.sweep_progress import make_sweep_reporter

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
    )
    reporter = make_sweep_reporter(quiet, comm.rank if comm else 0)
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
        Path | None, typer.Option("-o", "--output", help="Folder of the study. [default: runs/<name>]")
    ] = None,
    case_timeout: Annotated[float | None, typer.Option(min=0.0, help="Wall time of a case, in seconds.")] = None,
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Solve one case in many discretisations: what each costs, and how far off it is. study.csv, study.png.

    Works as a sweep: also under mpirun, and the same command continues what was stopped. Exit codes as those of sweep.
    """
    from pairsim.case_file import read_yaml
    from pairsim.study import run_study
    from pairsim.study_file import read_study
    from pairsim.sweep import launcher_communicator
    from pairsim.sweep_progress import make_sweep_reporter

    checked = read_study(file, read_yaml(file), tuple(set_ or ()))
    directory = output or Path("runs") / checked.name
    comm = launcher_communicator()
    reporter = make_sweep_reporter(quiet, comm.rank if comm else 0)
    code, message = run_study(checked, directory, case_timeout, comm, reporter)
    _end_sweep(code, message, directory, quiet)


@app.command(epilog="Examples: pairsim status runs/sweep | pairsim status study --watch")
def status(
    directory: Annotated[Path, typer.Argument(help="Folder of a sweep.", show_default=False)],
    watch: Annotated[bool, typer.Option("--watch", help="Repeat every two seconds until the sweep ends.")] = False,
) -> None:
    """Tell how a sweep stands: counts, rate, time left, and what failed for which reason."""
    import time

    from pairsim.ledger import at_work, read_sweep
    from pairsim.sweep_progress import status_view

    while True:
        working = at_work(directory)
        view = status_view(read_sweep(directory), working)
        if watch and sys.stdout.isatty():
            typer.echo(CLEAR, nl=False)
        _print(view)
        if not watch or not working:
            return
        time.sleep(2)


@app.command(epilog="Examples: pairsim plot runs/quickstart | pairsim plot runs/sweep --group Ca_e")
def plot(
    directory: Annotated[Path, typer.Argument(help="Folder of results.", show_default=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Where the pictures go. [default: the folder itself]")
    ] = None,
    group: Annotated[
        str | None, typer.Option(metavar="KEY", help="Parameter of a sweep that chooses the colours.")
    ] = None,
) -> None:
    """Draw the results of run, curve, critical, sweep or study as PNG.

    A run: dU and D against time and distance, and the deformed particles in the flow. A curve: dU and D against d.
    A sweep: dU of all cases against time and distance, the last dU against each parameter, and a map of how the cases
    ended.
    """
    if any(directory.glob("sweep*.json")):
        from pairsim.sweep_plots import plot_sweep

        paths = plot_sweep(directory, output, group)
    elif (directory / "study.csv").is_file():
        from pairsim.study_plots import plot_study

        paths = plot_study(directory, output)
    elif (directory / "curve.csv").is_file():
        from pairsim.curve_plots import plot_curve

        paths = plot_curve(directory, output or directory)
    elif (directory / "critical.csv").is_file():
        from pairsim.critical_plots import plot_critical

        paths = plot_critical(directory, output or directory)
    else:
        from pairsim.plots import plot_run

        paths = plot_run(directory, output)
    for path in paths:
        typer.echo(str(path))


@app.command(epilog="Example: pairsim schema curve")
def schema(
    command: Annotated[
        Literal["run", "curve", "critical"], typer.Argument(help="The command that the case file is for.")
    ] = "run",
) -> None:
    """List every key of a case file with what it accepts, its default and its meaning."""
    from rich.table import Table

    from pairsim.case_file import schema_rows

    table = Table("key", "allowed", "default", "meaning", box=None, pad_edge=False)
    for row in schema_rows(command):
        table.add_row(*row)
    _print(table)


def _print(view: object) -> None:
    """A table on stdout, wide enough where it is not a terminal."""
    from rich.console import Console

    Console(width=None if sys.stdout.isatty() else 160, markup=False, highlight=False).print(view)


def _rank() -> int:
    """Number of this process in its job."""
    if (mpi := sys.modules.get("mpi4py.MPI")) is not None:
        return int(mpi.COMM_WORLD.rank)
    launchers = ("PMI_RANK", "PMIX_RANK", "OMPI_COMM_WORLD_RANK", "SLURM_PROCID")
    return int(next((os.environ[name] for name in launchers if os.environ.get(name)), 0))


def main() -> NoReturn:
    """Entry point: errors that pairsim means become one message and an exit code, never a traceback."""
    try:
        app(standalone_mode=True)
    except InputError as error:
        _complain(error)
        sys.exit(2)
    except RunFailure as error:
        _complain(error)
        sys.exit(3)
    except PairsimError as error:
        _complain(error)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception:
        # Not meant to happen: show it, and leave no other process waiting for this one.
        traceback.print_exc()
        mpi = sys.modules.get("mpi4py.MPI")
        if mpi is not None and mpi.COMM_WORLD.size > 1:
            mpi.COMM_WORLD.Abort(1)
        sys.exit(1)
    sys.exit(0)


def _complain(error: Exception) -> None:
    """One message on stderr, by the first process only."""
    if _rank() == 0:
        typer.echo(f"pairsim: {error}", err=True)

"""The commands; everything heavy is imported inside them, so that --help and input errors are immediate."""

from __future__ import annotations

import os
import shlex
import sys
import traceback
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from pairsim import __version__
from pairsim.errors import InputError, PairsimError, RunFailure

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Soft and rigid spheres on the axis of a tube: do they separate or collide, and how fast?",
    epilog="Example: pairsim run configs/quickstart.yaml",
)

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


@app.command(
    epilog="Examples: pairsim run configs/quickstart.yaml | pairsim run case.yaml -o out --set Ca_e=0.05 | "
    "mpirun -n 2 pairsim run case.yaml"
)
def run(
    case: CaseFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder of the results. [default: runs/<name>]")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the results in an existing folder.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
    set_: Settings = None,
) -> None:
    """Run one case in time: series.csv, fields.xdmf, case.yaml and run.json.

    Exit code 0: finished (also at contact and max_gap); 2: bad input; 3: a typed failure; 130: interrupted.
    """
    from pairsim.case_file import load_case

    checked = load_case(case, tuple(set_ or ()))
    directory = output or Path("runs") / checked.slug

    from mpi4py import MPI

    import pairsim.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
    from pairsim.progress import make_reporter
    from pairsim.run import run_case

    comm = MPI.COMM_WORLD
    outcome = run_case(
        checked,
        directory,
        comm=comm,
        overwrite=overwrite,
        reporter=make_reporter(quiet, comm.rank),
        command=shlex.join(["pairsim", *sys.argv[1:]]),
    )
    if comm.rank == 0:
        if outcome.exit_code == 0:
            typer.echo(str(directory))
        elif quiet:
            typer.echo(outcome.message, err=True)
    raise typer.Exit(outcome.exit_code)


@app.command(
    epilog="Examples: pairsim curve configs/curve.yaml | pairsim curve case.yaml -o out "
    "--set 'd={start: 0.02, stop: 1, num: 12}'"
)
def curve(
    case: CaseFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder of the results. [default: runs/<name>]")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the results in an existing folder.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")] = False,
    set_: Settings = None,
) -> None:
    """Solve the quasi-steady master curve dU(d) and its zeros: curve.csv, equilibria.csv, curve.png, run.json.

    The case file has d (a list, or {start, stop, num, spacing}) in place of d0. Exit codes as those of run.
    """
    from pairsim.case_file import load_curve

    checked = load_curve(case, tuple(set_ or ()))
    directory = output or Path("runs") / checked.slug

    from mpi4py import MPI

    import pairsim.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
    from pairsim.curve_plots import plot_curve
    from pairsim.curve_run import run_curve
    from pairsim.progress import make_reporter

    comm = MPI.COMM_WORLD
    outcome = run_curve(
        checked,
        directory,
        comm=comm,
        overwrite=overwrite,
        reporter=make_reporter(quiet, comm.rank),
        command=shlex.join(["pairsim", *sys.argv[1:]]),
    )
    if comm.rank == 0:
        if outcome.exit_code == 0:
            plot_curve(directory, directory)
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


@app.command(epilog="Example: pairsim plot runs/quickstart")
def plot(
    directory: Annotated[Path, typer.Argument(help="Folder of a run.", show_default=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Where the pictures go. [default: the folder itself]")
    ] = None,
) -> None:
    """Draw a run: dU and D against time and distance, and the deformed particles in the flow, as PNG."""
    if (directory / "curve.csv").is_file():
        from pairsim.curve_plots import plot_curve

        paths = plot_curve(directory, output or directory)
    else:
        from pairsim.plots import plot_run

        paths = plot_run(directory, output)
    for path in paths:
        typer.echo(str(path))


@app.command()
def schema() -> None:
    """List every key of a case file with what it accepts, its default and its meaning."""
    from rich.console import Console
    from rich.table import Table

    from pairsim.case_file import schema_rows

    table = Table("key", "allowed", "default", "meaning", box=None, pad_edge=False)
    for row in schema_rows():
        table.add_row(*row)
    Console(width=None if sys.stdout.isatty() else 160, markup=False).print(table)


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
    rank = 0
    if (mpi := sys.modules.get("mpi4py.MPI")) is not None:
        rank = mpi.COMM_WORLD.rank
    else:
        launchers = ("PMI_RANK", "PMIX_RANK", "OMPI_COMM_WORLD_RANK", "SLURM_PROCID")
        rank = int(next((os.environ[name] for name in launchers if os.environ.get(name)), 0))
    if rank == 0:
        typer.echo(f"pairsim: {error}", err=True)

"""Commands for one case.

Large libraries are imported inside the commands, so that --help and input errors are printed at once.
"""

from __future__ import annotations

import os
import sys
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from pairsim.cli import bench, first_steps, pictures, sweeps
from pairsim.cli.options import (
    CaseFile,
    DryRun,
    Output,
    Overwrite,
    Progress,
    Quiet,
    Settings,
    rank,
    show_estimate,
    usable,
)
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
from pairsim.runtime.launcher import first_alone
from pairsim.runtime.signals import Signals, no_interrupt_lost
from pairsim.runtime.version import __version__, commit

if TYPE_CHECKING:
    from pairsim.api.results import Result
    from pairsim.drivers.progress import Style

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Soft and rigid spheres on the axis of a tube: do they separate or collide, and how fast?",
    epilog="Example: pairsim run configs/quickstart.yaml",
)
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


@app.command(
    epilog="Examples: pairsim run configs/quickstart.yaml | pairsim run case.yaml -o out --set Ca_e=0.05 | "
    "pairsim run --resume out --set time.end=4"
)
def run(
    case: Annotated[
        Path | None,
        typer.Argument(
            help="Case file (YAML); pairsim schema lists its keys.",
            show_default=False,
            callback=usable,
        ),
    ] = None,
    output: Output = None,
    overwrite: Overwrite = False,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Continue the run in this folder from its checkpoint. "
            "A case file or --set may change name, time.end, limits and output.",
            show_default=False,
            callback=usable,
        ),
    ] = None,
    dry_run: DryRun = False,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Compute one case in time.

    Writes series.csv, fields.xdmf, case.yaml, run.json and checkpoint.npz.
    Lengths are in tube diameters D_c, velocities in the mean velocity U_av, times
    in D_c/U_av.

    Exit codes: 0 finished (also at contact or max_gap), 2 wrong input, 3
    computation failed, 4 installation or system at fault (pairsim doctor), 130
    interrupted.
    """
    from pairsim.config.case_file import load_case
    from pairsim.config.cost import run_estimate
    from pairsim.config.identity import default_folder

    if resume is not None and (overwrite or output is not None):
        option = "--overwrite" if overwrite else "-o"
        raise InputError("pairsim run", option, None, "must be left out with --resume, which gives the folder")
    if case is None:
        if resume is None:
            raise typer.BadParameter("must be given, or else --resume DIR", param_hint="CASE")
        case = resume / "case.yaml"
    checked = load_case(case, tuple(set_ or ()))
    directory = resume or output or default_folder("run", checked)
    if dry_run:
        show_estimate(checked, directory, run_estimate(checked))
        return
    from pairsim.api import compute

    shown: Style = "none" if quiet else progress
    with _alone(), Signals(final=True):
        result = compute.run(
            checked,
            folder=directory,
            overwrite=overwrite,
            resume=resume is not None,
            progress=shown,
            signals=True,
        )
        _end(result, directory, shown, plot=False)


@app.command(
    epilog="Examples: pairsim curve configs/curve.yaml | pairsim curve case.yaml -o out --sensitivities "
    "--set 'd={start: 0.02, stop: 1, num: 12}'"
)
def curve(
    case: CaseFile,
    output: Output = None,
    overwrite: Overwrite = False,
    sensitivities: Annotated[
        bool,
        typer.Option("--sensitivities", help="Add the derivatives of dU with respect to Ca_e, De and beta at fixed d."),
    ] = False,
    dry_run: DryRun = False,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Compute the quasi-steady master curve dU(d) and its zeros.

    The case file has d (distances in tube diameters D_c: a list, or {start, stop,
    num, spacing}) in place of d0. Writes curve.csv (dU in U_av), equilibria.csv,
    curve.png, case.yaml and run.json.

    Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
    system at fault (pairsim doctor), 130 interrupted.
    """
    from pairsim.config.case_file import load_curve
    from pairsim.config.cost import curve_estimate
    from pairsim.config.identity import default_folder

    checked = load_curve(case, tuple(set_ or ()))
    directory = output or default_folder("curve", checked)
    if dry_run:
        show_estimate(checked, directory, curve_estimate(checked))
        return
    from pairsim.api import compute

    shown: Style = "none" if quiet else progress
    with _alone(), Signals(final=True):
        result = compute.curve(
            checked,
            folder=directory,
            overwrite=overwrite,
            sensitivities=sensitivities,
            progress=shown,
            signals=True,
        )
        _end(result, directory, shown, plot=True)


@app.command(
    epilog="Examples: pairsim critical configs/critical.yaml | "
    "pairsim critical case.yaml --set 'along={Ca_e: [0.02, 0.05, 0.1]}'"
)
def critical(
    case: CaseFile,
    output: Output = None,
    overwrite: Overwrite = False,
    dry_run: DryRun = False,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Find the distances at which dU = 0, and follow them over a parameter.

    The case file has along: {Ca_e: ...} or {De: ...} with values or {start, stop,
    num, spacing}, optionally lines: with values of the other parameter, and d:
    \\[least, largest], the range of distances in tube diameters D_c. Writes
    critical.csv, critical.png, case.yaml and run.json.

    Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
    system at fault (pairsim doctor), 130 interrupted.
    """
    from pairsim.config.case_file import load_critical
    from pairsim.config.cost import critical_estimate
    from pairsim.config.identity import default_folder

    checked = load_critical(case, tuple(set_ or ()))
    directory = output or default_folder("critical", checked)
    if dry_run:
        show_estimate(checked, directory, critical_estimate(checked))
        return
    from pairsim.api import compute

    shown: Style = "none" if quiet else progress
    with _alone(), Signals(final=True):
        result = compute.critical(checked, folder=directory, overwrite=overwrite, progress=shown, signals=True)
        _end(result, directory, shown, plot=True)


def _alone() -> AbstractContextManager[None]:
    """Context of the commands for one case: under mpirun the first process computes it."""
    return first_alone(lambda note: typer.echo(f"pairsim: note: {note}", err=True))


def _end(result: Result, directory: Path, shown: Style, plot: bool) -> NoReturn:
    """Draw, give the folder (stdout) and what to do next (stderr), and exit with the code of the outcome."""
    from pairsim.drivers.outcome import exit_code
    from pairsim.results.answer import advice

    code = exit_code(result.status, result.reason)
    if code == 0:
        if plot:
            try:
                result.plot(directory)
            except InputError as error:
                typer.echo(f"warning: no picture: {error}; pairsim plot {directory} draws it", err=True)
        typer.echo(str(directory))
    if shown == "none" and code:
        typer.echo(result.message, err=True)
    elif shown not in ("none", "json") and directory.is_dir():
        pair = "dU" in result.table
        typer.echo(advice(result.kind, result.status, result.reason, result.message, directory, pair), err=True)
    raise typer.Exit(code)


@app.command(epilog="Example: pairsim mesh configs/quickstart.yaml -o meshes/pair.msh --png meshes/pair.png")
def mesh(
    case: CaseFile,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="Mesh file: .msh (gmsh), .vtu or .xdmf.",
            callback=usable,
        ),
    ],
    png: Annotated[
        Path | None,
        typer.Option(
            "--png",
            help="Picture of the mesh around the particles.",
            callback=usable,
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
    set_: Settings = None,
) -> None:
    """Write the mesh with which a run of a case begins.

    Lengths are in tube diameters D_c. Prints the numbers of cells, nodes and
    arcs.
    """
    from pairsim.config.case_file import load_case

    checked = load_case(case, tuple(set_ or ()))
    for option, path in (("-o", output), ("--png", png)):
        if path is not None and path.exists() and not overwrite:
            raise InputError(str(path), option, None, "the file exists; use --overwrite or another name")
    if output.suffix not in (".msh", ".vtu", ".xdmf"):
        raise InputError(str(output), "-o", output.suffix, "must be a name ending in .msh, .vtu or .xdmf")

    from pairsim.drivers.mesh import write_mesh

    for name, count in write_mesh(checked, output, png).items():
        typer.echo(f"{name}: {count}")


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

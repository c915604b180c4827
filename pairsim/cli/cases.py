"""The commands for one case: `run`, `curve`, `critical`, `shape`, and `mesh`.

Large libraries are imported inside the functions, so that --help and input errors are printed at once.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

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
)
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.api.results import Result
    from pairsim.computing.progress import Style

app = typer.Typer(rich_markup_mode="rich")


@app.command(
    epilog="Examples: pairsim run configs/quickstart.yaml | pairsim run case.yaml -o out --set Ca_e=0.05 | "
    "pairsim run --resume out --set time.end=4"
)
def run(
    case: Annotated[Path | None, path_argument("Case file (YAML); pairsim schema lists its keys.")] = None,
    output: Output = None,
    overwrite: Overwrite = False,
    resume: Annotated[
        Path | None,
        path_option(
            "--resume",
            metavar="DIR",
            words="Continue the run in this folder from its checkpoint. "
            "A case file or --set may change name, time.end, limits and output.",
        ),
    ] = None,
    budget: Budget = None,
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
    if resume is not None and (overwrite or output is not None):
        option, allowed = "--overwrite" if overwrite else "-o", "must be left out with --resume, which gives the folder"
        raise InputError("pairsim run", option, None, allowed)
    if case is None and resume is None:
        raise typer.BadParameter("must be given, or else --resume DIR", param_hint="CASE")
    file, folder = case or Path(resume or "", "case.yaml"), resume or output
    flags = {"resume": resume is not None}
    _compute("run", file, folder, overwrite, budget, dry_run, "none" if quiet else progress, set_, flags)


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
    budget: Budget = None,
    dry_run: DryRun = False,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Compute the quasi-steady master curve dU(d) and its zeros.

    The case file has d (distances in tube diameters D_c: a list, or {start, stop,
    num, spacing}) in place of d0. Writes curve.csv (dU in U_av), equilibria.csv,
    curve.png of two points or more, case.yaml and run.json.

    Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
    system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
    """
    flags = {"sensitivities": sensitivities}
    _compute("curve", case, output, overwrite, budget, dry_run, "none" if quiet else progress, set_, flags)


@app.command(
    epilog="Examples: pairsim critical configs/critical.yaml | "
    "pairsim critical case.yaml --set 'along={Ca_e: [0.02, 0.05, 0.1]}'"
)
def critical(
    case: CaseFile,
    output: Output = None,
    overwrite: Overwrite = False,
    budget: Budget = None,
    dry_run: DryRun = False,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    r"""Find the distances at which dU = 0, and follow them over a parameter.

    The case file has along: {Ca_e: ...} or {De: ...} with values or {start, stop,
    num, spacing}, optionally lines: with values of the other parameter, and d:
    \[least, largest], the range of distances in tube diameters D_c. Writes
    critical.csv, critical.png, case.yaml and run.json.

    Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
    system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
    """
    _compute("critical", case, output, overwrite, budget, dry_run, "none" if quiet else progress, set_, {})


@app.command(
    epilog="Examples: pairsim shape case.yaml | "
    "pairsim shape case.yaml -o out --set 'along={start: 0.01, stop: 0.2, num: 8}'"
)
def shape(
    case: CaseFile,
    output: Output = None,
    overwrite: Overwrite = False,
    budget: Budget = None,
    dry_run: DryRun = False,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Compute the steady shape of one particle over Ca_e.

    The case file has particles: 1, and along: values of Ca_e (a list, or {start,
    stop, num, spacing}). Writes shape.csv (Taylor's D with its error, U in U_av),
    shape.png, case.yaml and run.json.

    Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
    system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
    """
    _compute("shape", case, output, overwrite, budget, dry_run, "none" if quiet else progress, set_, {})


def _compute(
    name: str,
    file: Path,
    folder: Path | None,
    overwrite: bool,
    budget: str | None,
    dry_run: bool,
    shown: Style,
    settings: list[str] | None,
    flags: dict[str, bool],
) -> None:
    """Check a case, and show its cost, or compute it by the function of the Python interface."""
    from pairsim.cases.identity import default_folder
    from pairsim.computing import QUESTIONS
    from pairsim.computing.case_files import read_case
    from pairsim.runtime.launcher import check_single
    from pairsim.runtime.signals import Signals

    check_single()
    question = QUESTIONS[name]
    case = read_case(question, file, tuple(settings or ()))
    directory = folder or default_folder(name, case, file.stem)
    if dry_run:
        notes = (f"note: {note}" for note in case.notes)
        typer.echo("\n".join([f"{directory}: {question.estimate(case)}", *notes]))
        return
    from pairsim.api import compute

    with Signals(final=True) as signals:
        result = getattr(compute, name)(
            case, folder=directory, overwrite=overwrite, progress=shown, signals=signals, budget=budget, **flags
        )
        _end(result, directory, shown)


def _end(result: Result, directory: Path, shown: Style) -> NoReturn:
    """Draw, give the folder (stdout) and what to do next (stderr), and exit with the code of the outcome."""
    from pairsim.computing.answer import advice
    from pairsim.computing.question import rows_in
    from pairsim.computing.record import exit_code
    from pairsim.results.folder import FIELDS_XDMF

    question, code = result.command, exit_code(result.status, result.reason)
    rows, least = rows_in(result.columns), question.draws_from
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
    elif shown != "none" and directory.is_dir():
        afterwards = question.afterwards(directory, rows > 1 and "dU" in result.columns)
        ended = result.status, result.reason, result.message
        typer.echo(advice(afterwards, *ended, directory, question.resumable), err=True)
    raise typer.Exit(code)


@app.command(epilog="Example: pairsim mesh configs/quickstart.yaml -o meshes/pair.msh")
def mesh(
    case: CaseFile,
    output: Annotated[Path, path_option("-o", "--output", words="Mesh file: .msh (gmsh), .vtu or .xdmf.")],
    overwrite: OverwriteFile = False,
    set_: Settings = None,
) -> None:
    """Write the mesh with which a run of a case begins.

    Lengths are in tube diameters D_c. Prints the numbers of cells and nodes.
    """
    from pairsim.computing import QUESTIONS
    from pairsim.computing.case_files import read_case

    checked = read_case(QUESTIONS["run"], case, tuple(set_ or ()))
    check_free(output, overwrite)
    if output.suffix not in (".msh", ".vtu", ".xdmf"):
        raise InputError(str(output), "-o", output.suffix, "must be a name ending in .msh, .vtu or .xdmf")

    from pairsim.computing.mesh import write_mesh

    for name, count in write_mesh(checked, output).items():
        typer.echo(f"{name}: {count}")

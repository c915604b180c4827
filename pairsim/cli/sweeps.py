"""Commands for many cases: `sweep`, `study`, and `atlas`, which also makes the page of an atlas."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from pairsim.cli.options import OverwriteFile, Quiet, Settings, check_free, print_table
from pairsim.runtime.launcher import rank
from pairsim.runtime.signals import Signals

app = typer.Typer()
EXPLORE = "explore"

Output = Annotated[Path | None, typer.Option("-o", "--output", help="Folder for the results (default: runs/<name>).")]
Workers = Annotated[int, typer.Option(help="Number of cases at the same time, without mpirun.", min=1)]
CaseTimeout = Annotated[float | None, typer.Option(help="Largest wall time of a case, in seconds.", min=0.0)]


@app.command(
    epilog="Examples: pairsim sweep grid.yaml --dry-run | pairsim sweep grid.yaml --workers 4 | "
    "mpirun -n 8 pairsim sweep grid.yaml -o out"
)
def sweep(
    grid: Annotated[Path, typer.Argument(help="Grid file (YAML): base, grid, zip, cases, exclude.")],
    output: Output = None,
    workers: Workers = 1,
    case_timeout: CaseTimeout = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="List the cases with estimated unknowns; compute nothing.")
    ] = False,
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Compute every case of a grid; the same command continues an interrupted sweep.

    Each case has its own folder, which says how it stands; results.csv has the
    main results of all cases. Under mpirun or srun, the cases are distributed
    over the processes.

    Exit codes: 0 no case failed, 2 wrong input, 3 some cases failed, 4
    installation or system at fault (pairsim doctor), 130 interrupted.
    """
    settings = set_ or ()
    if dry_run:
        from pairsim.sweeps.grid import read_grid
        from pairsim.sweeps.progress import dry_run_view

        if rank() == 0:
            print_table(dry_run_view(read_grid(grid, settings)))
        return
    from pairsim.api import sweeps

    with Signals(final=True) as signals:
        result = sweeps.sweep(
            grid,
            folder=output,
            workers=workers,
            case_timeout=case_timeout,
            progress=not quiet,
            signals=signals,
            settings=settings,
        )
    folder = result.folder
    after = f"pairsim table {folder} results has what was found in each case; pairsim plot {folder} draws it"
    end(result.exit_code, result.message, folder, "" if quiet else after)


def end(code: int, message: str, directory: Path, after: str = "") -> NoReturn:
    """Say how a sweep or study has ended and, if no case has failed, what comes next, and give its folder."""
    if rank() == 0:
        with suppress(OSError):  # a terminal that is gone changes no exit code
            typer.echo(message, err=True)
            if code == 0 and after:
                typer.echo(f"Next: {after}.", err=True)
        if code == 0:
            typer.echo(str(directory))
    raise typer.Exit(code)


@app.command(
    epilog="Examples: pairsim study configs/study.yaml | mpirun -n 2 pairsim study configs/study.yaml -o mesh-study"
)
def study(
    file: Annotated[Path, typer.Argument(help="Study file (YAML): base, at, discretisations, reference.")],
    output: Output = None,
    case_timeout: CaseTimeout = None,
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    """Compute one case with several meshes and time steps, and compare errors and wall times.

    Writes study.csv and study.png. As for a sweep, the same command continues an
    interrupted study, and mpirun distributes the cases over the processes.

    Exit codes: 0 no case failed, 2 wrong input, 3 some cases failed, 4
    installation or system at fault (pairsim doctor), 130 interrupted.
    """
    from pairsim.sweeps.study import compute_study
    from pairsim.sweeps.sweep import Options

    with Signals(final=True) as signals:
        options = Options(case_timeout, not quiet, signals)
        code, message, folder = compute_study(file, output, options, set_ or ())
    after = f"{folder}/study.csv has errors and times, {folder}/study.png draws them"
    end(code, message, folder, "" if quiet else after)


@app.command(
    epilog="Examples: pairsim atlas configs/atlas/equal-pairs.yaml --workers 2 | pairsim atlas explore -o page.html"
)
def atlas(
    file: Annotated[
        Path, typer.Argument(help=f"Atlas file (YAML): beta, De, Ca_e, d, curves, base; or {EXPLORE}: an HTML page.")
    ],
    output: Output = None,
    of: Annotated[
        Path | None, typer.Option("--atlas", help=f"With {EXPLORE}: file of an atlas (default: those that ship).")
    ] = None,
    workers: Workers = 1,
    case_timeout: CaseTimeout = None,
    overwrite: OverwriteFile = False,
    quiet: Quiet = False,
) -> None:
    """Build an atlas: dU at any beta, De, Ca_e and d of a box, with intervals, from master curves.

    Curves are computed in rounds: at the corners of the box, then where the
    interval is widest, and in each round as many at random places. After each
    round atlas.npz is written. The same command continues an interrupted one;
    with more curves in the file it adds rounds. With explore in place of a file
    it writes an HTML page with sliders, which needs no server (-o, default:
    explore.html), from an atlas.

    Exit codes: 0 no curve failed, 2 wrong input, 3 some curves failed, 4
    installation or system at fault (pairsim doctor), 130 interrupted.
    """
    if str(file) == EXPLORE:
        from pairsim.atlas.atlas import SHIPPED, Atlas
        from pairsim.atlas.explorer import page_of
        from pairsim.cases.coverage import liquid_of_atlas
        from pairsim.computing import QUESTIONS
        from pairsim.results.folder import write_file

        path = output or Path("explore.html")
        check_free(path, overwrite)
        model, atlases = QUESTIONS["curve"].model, [*map(Atlas.load, [of] if of else SHIPPED)]
        write_file(path, page_of((liquid_of_atlas(each, model), each) for each in atlases))
        typer.echo(str(path))
        return
    from pairsim.sweeps.atlas import build
    from pairsim.sweeps.sweep import Options, with_workers

    with Signals(final=True) as signals:
        options = Options(case_timeout, not quiet, signals)
        result = with_workers(lambda those: build(file, output, options, those), count=workers)
    end(*result)

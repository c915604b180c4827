"""`pairsim atlas`: build an interpolant of many master curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pairsim.cli.options import OverwriteFile, Quiet, check_free
from pairsim.cli.sweeps import CaseTimeout, Output, Workers, end
from pairsim.runtime.signals import Signals

app = typer.Typer()


EXPLORE = "explore"


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

    Curves are computed in rounds, the first spread evenly, the later ones where
    the interpolant errs most. After each round atlas.npz is written. The same
    command continues an interrupted one; with more curves in the file it adds
    rounds. With explore in place of a file it writes an HTML page with sliders,
    which needs no server (-o, default: explore.html), from an atlas.

    Exit codes: 0 no curve failed, 2 wrong input, 3 some curves failed, 4
    installation or system at fault (pairsim doctor), 130 interrupted.
    """
    if str(file) == EXPLORE:
        from pairsim.atlas.atlas import SHIPPED, Atlas
        from pairsim.atlas.explorer import page_of
        from pairsim.results.folder import write_file

        path = output or Path("explore.html")
        check_free(path, overwrite)
        write_file(path, page_of(map(Atlas.load, [of] if of else SHIPPED)))
        typer.echo(str(path))
        return
    from pairsim.sweeps.atlas import build
    from pairsim.sweeps.sweep import Options, with_workers

    with Signals(final=True) as signals:
        options = Options(case_timeout, not quiet, signals)
        result = with_workers(lambda those: build(file, output, options, those), count=workers)
    end(*result)

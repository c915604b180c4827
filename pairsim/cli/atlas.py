"""`pairsim atlas`: build an interpolant of many master curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pairsim.cli.options import Quiet
from pairsim.cli.sweeps import CaseTimeout, Output, Workers, end
from pairsim.runtime.signals import Signals

app = typer.Typer()


@app.command(epilog="Example: pairsim atlas configs/atlas/equal-pairs.yaml --workers 2")
def atlas(
    file: Annotated[Path, typer.Argument(help="Atlas file (YAML): beta, De, Ca_e, d, curves, base.")],
    output: Output = None,
    workers: Workers = 1,
    case_timeout: CaseTimeout = None,
    quiet: Quiet = False,
) -> None:
    """Build an atlas: dU at any beta, De, Ca_e and d of a box, with intervals, from master curves.

    Curves are computed in rounds, the first spread evenly, the later ones where the
    interpolant errs most. After each round atlas.npz is written. The same command
    continues an interrupted one; with more curves in the file it adds rounds.

    Exit codes: 0 no curve failed, 2 wrong input, 3 some curves failed, 4
    installation or system at fault (pairsim doctor), 130 interrupted.
    """
    from pairsim.sweeps.atlas import build
    from pairsim.sweeps.sweep import Options, with_workers

    with Signals(final=True) as signals:
        options = Options(case_timeout, not quiet, signals)
        result = with_workers(lambda those: build(file, output, options, those), count=workers)
    end(*result)

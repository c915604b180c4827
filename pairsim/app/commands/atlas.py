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

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pairsim.app.exit_codes import end
from pairsim.app.options import CaseTimeout, OutputOfMany, OverwriteFile, Quiet, Workers, check_free
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import write_file
from pairsim.runtime.signals import Signals

EXAMPLES = "Examples: pairsim atlas configs/atlas/equal-pairs.yaml --workers 2 | pairsim atlas explore -o page.html"

EXPLORE = "explore"


def atlas(
    file: Annotated[
        Path,
        typer.Argument(help=f"Atlas file (YAML): beta, De, Ca_e, d, curves, base; or {EXPLORE}, for an HTML page."),
    ],
    folder: OutputOfMany = None,
    of: Annotated[
        Path | None, typer.Option("--atlas", help=f"With {EXPLORE}: atlas file (default: those that ship).")
    ] = None,
    workers: Workers = 1,
    case_timeout: CaseTimeout = None,
    overwrite: OverwriteFile = False,
    quiet: Quiet = False,
) -> None:
    if str(file) == EXPLORE:
        from pairsim.atlas.atlas import SHIPPED, Atlas
        from pairsim.atlas.explorer import page_of
        from pairsim.cases.coverage import liquid_of_atlas

        path = folder or Path("explore.html")
        check_free(path, overwrite)
        model, atlases = QUESTIONS["curve"].model, [*map(Atlas.load, [of] if of else SHIPPED)]
        write_file(path, page_of((liquid_of_atlas(each, model), each) for each in atlases), "-o")
        typer.echo(str(path))
        return
    from pairsim.sweeps.atlas_building import build
    from pairsim.sweeps.sweep import Options, with_workers

    with Signals(final=True) as signals:
        options = Options(case_timeout, not quiet, signals)
        ending, made = with_workers(lambda those: build(file, folder, options, those), count=workers)
    end(*ending, made)

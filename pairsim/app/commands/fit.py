"""Fit the modulus of two beads, or the relaxation time of their liquid, to a film of their distance.

The interval contains the half-widths of the case, such as
particle: 20 +- 0.4 um, and particle_difference: 0 +- 0.5 %, by which the
leading bead is larger than the trailing one; without it this difference is
unknown. Tables of TrackPy, TrackMate, ImageJ and others are read as they
are: their positions are those of centres, and the diameter is that of the
case.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pairsim
from pairsim.app.options import Fps, Particles, Pixel, Settings
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import InputError

EXAMPLES = (
    "Examples: pairsim fit film.csv case.yaml | "
    "pairsim fit tracks.csv case.yaml --fps 500 --pixel '.65 +- .01 um' --particles 3,5"
)


def fit(
    film: Annotated[Path, typer.Argument(help=r"Table with columns such as t \[s] and d \[um], or from a tracker.")],
    case: Annotated[Path, typer.Argument(help="Case file with a physical block; what is unknown may be left out.")],
    unknown: Annotated[
        list[str] | None, typer.Option(help="What is fitted: modulus (default), relaxation or both.")
    ] = None,
    fps: Fps = None,
    pixel: Pixel = None,
    particles: Particles = None,
    exchanged: Annotated[
        Path | None,
        typer.Option(
            metavar="FILM", help="Second film of the same beads, with the other one leading or the flow reversed."
        ),
    ] = None,
    atlas: Annotated[Path | None, typer.Option(help="Atlas file (default: those that ship).")] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder for a picture, film.png.")] = None,
    set_: Settings = None,
) -> None:
    from pairsim.computing.case_files import content_of_file

    given = content_of_file(QUESTIONS["curve"].model, case, tuple(set_)) if set_ else case
    typer.echo("fit: trying values over the range of the atlas, some seconds", err=True)
    try:
        found = pairsim.fit(
            film,
            given,
            unknown=unknown or "modulus",
            exchanged=exchanged,
            atlas=atlas,
            fps=fps,
            pixel=pixel,
            particles=particles,
        )
    except InputError as error:
        for each in error.mistakes:
            each.file = str(case) if each.file == "case" else each.file  # of the keys of a file with settings
        raise
    typer.echo(str(found))
    if output is not None:
        typer.echo(str(*found.plot(output)))

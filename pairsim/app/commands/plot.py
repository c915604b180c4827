"""Draw the results of a case, a sweep or a study, or several runs or curves in one picture.

A run: dU and D against time and distance, and the deformed particles in the
flow. A curve: dU with its error and its zeros, D, and its fields. Critical
distances, shapes and pressure drops: over what was followed. A sweep: dU of
all cases, the last dU or the zeros against a parameter. A study: error
against wall time. Several folders: dU of all of them; what varies is in the
legend, what does not in small print. RUN CURVE FILM.csv: a film, as for fit,
beside the motion by a run and a curve.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pairsim
from pairsim.app.options import Fps, Particles, Physical, Pixel

EXAMPLES = (
    "Examples: pairsim plot runs/quickstart | pairsim plot runs/curve --format pdf,svg --width 85mm | "
    "pairsim plot runs/a runs/b runs/c -o pictures | pairsim plot runs/sweep --group Ca_e | "
    "pairsim plot runs/viscoelastic --field N1,tr_c | pairsim plot runs/quickstart --field streamlines --animate"
)


def plot(
    folders: Annotated[list[Path], typer.Argument(help="Folders of results.", metavar="DIR...")],
    out: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for the pictures (default: that of the results).")
    ] = None,
    formats: Annotated[
        str | None,
        typer.Option("--format", metavar="png,pdf,svg", help="Formats of the pictures, one or more (default: png)."),
    ] = None,
    width: Annotated[
        str, typer.Option(metavar="MM", help="Width: 85mm for a column of a journal, 170mm for a page.")
    ] = "170mm",
    field: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Draw only fields of a run or a curve: velocity, streamlines, tr_c, yielding (where a liquid with a "
            "yield stress flows), N1 (tau_zz - tau_rr), tau_zz, pressure, velocity_extra, tau_zz_extra, "
            "pressure_extra (differences from the flow without particles), or all.",
        ),
    ] = None,
    animate: Annotated[
        bool, typer.Option("--animate", help="Make a GIF of the fields at all times (of a curve: at all distances).")
    ] = False,
    group: Annotated[
        str | None, typer.Option(metavar="KEY", help="Parameter of a sweep, or of several folders, shown by colours.")
    ] = None,
    physical: Physical = None,
    legend: Annotated[
        bool, typer.Option(" /--no-legend", show_default=False, help="Leave out the legend and the small print.")
    ] = True,
    fps: Fps = None,
    pixel: Pixel = None,
    particles: Particles = None,
) -> None:
    paths = pairsim.plot(
        *folders,
        out=out,
        formats=formats,
        width=width,
        group=group,
        field=field,
        animate=animate,
        physical=physical,
        legend=legend,
        fps=fps,
        pixel=pixel,
        particles=particles,
    )
    for path in paths:
        typer.echo(str(path))
    if not paths:
        typer.echo("note: nothing to draw: the folder holds no line of values", err=True)

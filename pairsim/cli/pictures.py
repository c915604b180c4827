"""Commands that show results: plot and report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from pairsim.cli.options import Folder, Physical, path_argument, path_option

app = typer.Typer(rich_markup_mode="rich")


@app.command(
    epilog="Examples: pairsim plot runs/quickstart | pairsim plot runs/curve --format pdf,svg --width 85mm | "
    "pairsim plot runs/a runs/b runs/c -o pictures | pairsim plot runs/sweep --group Ca_e | "
    "pairsim plot runs/viscoelastic --field N1,tr_c | pairsim plot runs/quickstart --field streamlines --animate"
)
def plot(
    folders: Annotated[list[Path], path_argument("Folders of results.", metavar="DIR...")],
    output: Annotated[
        Path | None, path_option("-o", "--output", words="Where the pictures go (default: the folder itself).")
    ] = None,
    formats: Annotated[
        str | None,
        typer.Option(
            "--format",
            metavar="png,pdf,svg",
            help="Kinds of files, one or more (default: png); of --animate mp4 or gif (default: mp4 where ffmpeg is "
            "found).",
        ),
    ] = None,
    width: Annotated[
        str, typer.Option(metavar="MM", help="Width: 85mm for a column of a journal, 170mm for a page.")
    ] = "170mm",
    field: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Fields of a run or a curve, and nothing else: velocity, streamlines, tr_c, N1 (tau_zz - tau_rr), "
            "tau_zz, pressure, velocity_extra, tau_zz_extra, pressure_extra (less what is there without particles), "
            "or all.",
        ),
    ] = None,
    animate: Annotated[
        bool, typer.Option("--animate", help="Make the fields an animation of all times (of a curve: distances).")
    ] = False,
    group: Annotated[
        str | None, typer.Option(metavar="KEY", help="Parameter of a sweep, or of several folders, for the colours.")
    ] = None,
    panels: Annotated[
        str | None, typer.Option(metavar="KEY", help="Such a parameter whose values have a panel each.")
    ] = None,
    physical: Physical = None,
) -> None:
    """Draw the results of run, curve, critical, sweep or study, or several runs or curves in one picture.

    A run: dU and D against time and distance, and the deformed particles in the flow. A curve: dU with its error and
    its zeros, D, and its fields. Critical distances: over the parameter that was followed. A sweep: dU of all cases,
    the last dU or the zeros against each parameter, a map of how the cases ended. A study: error against wall time.
    Several folders: dU of all of them; what varies is in the legend, what does not in small print.
    """
    from pairsim.api.pictures import plot

    look: dict[str, Any] = {"out": output, "formats": formats, "width": width, "physical": physical}
    paths = plot(*folders, **look, group=group, panels=panels, field=field, animate=animate)
    for path in paths:
        typer.echo(str(path))
    if not paths:
        typer.echo("note: nothing to draw: the folder holds no line of values", err=True)
    if animate and formats is None and paths[0].suffix == ".gif":
        typer.echo("note: a GIF, as no ffmpeg was found; MP4 needs it: pip install imageio-ffmpeg", err=True)


@app.command(epilog="Examples: pairsim report runs/quickstart | pairsim report runs/sweep")
def report(directory: Folder) -> None:
    """Write DIR/report.html: answer, warnings, pictures, table and provenance on one page.

    One file that needs no network, to send around; of run, curve, critical or sweep, finished or not. It is
    replaced where it exists.
    """
    from pairsim.api.report import report

    typer.echo(str(report(directory)))

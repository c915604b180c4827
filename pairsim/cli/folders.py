"""Commands that read folders of results, and `moduli`, which reads a cytometer's file."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import pairsim
from pairsim.cli.options import Folder, Fps, OverwriteFile, Particles, Physical, Pixel, check_free, print_table
from pairsim.runtime.errors import InputError

app = typer.Typer()


@app.command(epilog="Examples: pairsim status runs/sweep | pairsim status runs/quickstart")
def status(directory: Folder) -> None:
    """Show the status of a folder of results.

    Of a sweep or study the number of cases by status, and the reasons of
    failures; of a case whether it is running or how it ended, wall time in s,
    and warnings.
    """
    from pairsim.results.folder import kind_of
    from pairsim.runtime.locks import is_locked
    from pairsim.sweeps.folder import read_sweep
    from pairsim.sweeps.progress import status_view

    if kind_of(directory) in ("sweep", "study"):
        print_table(status_view(read_sweep(directory, values=False), is_locked(directory)))
    else:
        result = pairsim.open(directory)
        reason = f" ({result.reason})" if result.reason not in ("", result.status) else ""
        cost = f"{result.record.wall_time or 0.0:.3g} s of wall time, by: {result.record.command}"
        warnings = (f"warning: {warning}" for warning in result.warnings)
        after = result.advice if result.status not in ("finished", "running") else ""
        lines = (f"{directory}: {result.status}{reason}", result.happened, cost, *warnings, after)
        typer.echo("\n".join(filter(None, lines)))


@app.command(
    epilog="Examples: pairsim table runs/quickstart | pairsim table runs/case --dimensionless -o series.csv | "
    "pairsim table runs/curve equilibria | pairsim table runs/curve --at 8um | pairsim table runs/sweep equilibria"
)
def table(
    directory: Annotated[Path, typer.Argument(help="Folder of a case or of a sweep.")],
    name: Annotated[
        str | None, typer.Argument(help="A table of the folder, such as equilibria (default: its main one).")
    ] = None,
    physical: Physical = None,
    cytometry: Annotated[
        bool, typer.Option("--cytometry", help="Of a sweep of shape: a table of moduli for pairsim moduli and dclab.")
    ] = False,
    channel: Annotated[
        Literal["equivalent", "square", "round"],
        typer.Option(
            help="With --cytometry, the channel of the cytometer: square, for which the tube stands (equivalent: "
            "moduli of the tube as they are; square: corrected for the walls), or round, the tube itself."
        ),
    ] = "equivalent",
    at: Annotated[
        list[str] | None,
        typer.Option("--at", metavar="D", help="Of a curve: dU and its error at a distance, such as 8um; repeat it."),
    ] = None,
    all_: Annotated[bool, typer.Option("--all", help="All columns; on a terminal all rows, too.")] = False,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="CSV file to write (default: print).")] = None,
    netcdf: Annotated[Path | None, typer.Option(metavar="FILE", help="Of a sweep: a netCDF file to write.")] = None,
    overwrite: OverwriteFile = False,
) -> None:
    """Print a table of results, with the unit of each column in the header.

    Of a run or a curve the columns t, d, dU, dU_error and U, with --all all
    columns. A terminal shows five digits; a file or a pipe gets CSV with all
    digits. Units are um, s, um/s and Pa where the case has a physical block, else
    D_c, U_av and D_c/U_av. Of a sweep, the tables of all cases, one below the
    other, with the parameters that vary.
    """
    check_free(output, overwrite)
    check_free(netcdf, overwrite, "--netcdf")
    if channel != "equivalent" and not cytometry:
        raise InputError("pairsim table", "--channel", channel, "must be given with --cytometry")
    if cytometry:
        from pairsim.results.cytometry import look_up_table

        if given := name or (physical is not None and "--physical"):
            raise InputError("pairsim table", given, None, "must be left out with --cytometry")
        text, notes = look_up_table(directory, channel)
        for note in notes:
            typer.echo(f"note: {note}", err=True)
        _print(text, output)
        return
    from pairsim.results.folder import write_file
    from pairsim.results.tables import csv_text, readable, screen_text

    result = pairsim.open(directory)
    if netcdf is not None:
        if not isinstance(result, pairsim.SweepResult):
            raise InputError(str(directory), "--netcdf", None, "must be given with the folder of a sweep")
        write_file(netcdf, bytes(result.to_xarray(name, physical=physical).to_netcdf(engine="scipy")), "--netcdf")
        return typer.echo(str(netcdf))
    found = result.frame(name, physical=physical, at=at or ())
    if output is None and sys.stdout.isatty():
        typer.echo(screen_text(found, shutil.get_terminal_size().columns, all_))
    else:
        _print(csv_text(readable(found, all_)), output)


def _print(text: str, output: Path | None) -> None:
    """Write a text to a file, or to stdout."""
    if output is None:
        typer.echo(text, nl=False)
    else:
        from pairsim.results.folder import write_file

        write_file(output, text)
        typer.echo(str(output))


@app.command(
    epilog="Examples: pairsim travel runs/curve --from 0.1 --to 0.5 | pairsim travel runs/curve --from 5um --to 25um"
)
def travel(
    directory: Annotated[Path, typer.Argument(help="Folder of curve.")],
    start: Annotated[
        str, typer.Option("--from", metavar="D", help="First distance, in tube diameters D_c or with a unit.")
    ],
    stop: Annotated[
        str, typer.Option("--to", metavar="D", help="Last distance, in tube diameters D_c or with a unit.")
    ],
) -> None:
    """Compute the time and the length of tube in which a pair moves from one distance to another, from its curve.

    The time is the integral of dc/dU [D_c/U_av] over the distance c between the
    centres of volume, the length that of U/dU dc with the mean velocity U of the
    pair [D_c]; there must be no zero of dU between the distances. Their
    half-widths follow from that of dU along the curve. If the case has a physical
    block, both are in s and mm. Also prints by how much the time changes for a
    pair that starts from rest at the first distance, and where that is forgotten.
    """
    from pairsim.results.folder import kind_of

    if (kind := kind_of(directory)) != "curve":
        raise InputError(str(directory), "", None, f"must be a folder of `pairsim curve`, not of `pairsim {kind}`")
    typer.echo(str(pairsim.open(directory).travel(start, stop)))


@app.command(
    epilog="Examples: pairsim plot runs/quickstart | pairsim plot runs/curve --format pdf,svg --width 85mm | "
    "pairsim plot runs/a runs/b runs/c -o pictures | pairsim plot runs/sweep --group Ca_e | "
    "pairsim plot runs/viscoelastic --field N1,tr_c | pairsim plot runs/quickstart --field streamlines --animate"
)
def plot(
    folders: Annotated[list[Path], typer.Argument(help="Folders of results.", metavar="DIR...")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Where the pictures go (default: the folder itself).")
    ] = None,
    formats: Annotated[
        str | None, typer.Option("--format", metavar="png,pdf,svg", help="Kinds of files, one or more (default: png).")
    ] = None,
    width: Annotated[
        str, typer.Option(metavar="MM", help="Width: 85mm for a column of a journal, 170mm for a page.")
    ] = "170mm",
    field: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Fields of a run or a curve, and nothing else: velocity, streamlines, tr_c, yielding (where a "
            "liquid with a yield stress flows), N1 (tau_zz - tau_rr), tau_zz, pressure, velocity_extra, tau_zz_extra, "
            "pressure_extra (less what is there without particles), or all.",
        ),
    ] = None,
    animate: Annotated[
        bool, typer.Option("--animate", help="Make the fields a GIF of all times (of a curve: distances).")
    ] = False,
    group: Annotated[
        str | None, typer.Option(metavar="KEY", help="Parameter of a sweep, or of several folders, for the colours.")
    ] = None,
    physical: Physical = None,
    legend: Annotated[
        bool, typer.Option(" /--no-legend", show_default=False, help="Leave out the legend and the small print.")
    ] = True,
    fps: Fps = None,
    pixel: Pixel = None,
    particles: Particles = None,
) -> None:
    """Draw the results of a case, a sweep or a study, or several runs or curves in one picture.

    A run: dU and D against time and distance, and the deformed particles in the
    flow. A curve: dU with its error and its zeros, D, and its fields. Critical
    distances, shapes and pressure drops: over what was followed. A sweep: dU of
    all cases, the last dU or the zeros against a parameter. A study: error
    against wall time. Several folders: dU of all of them; what varies is in the
    legend, what does not in small print. RUN CURVE FILM.csv: a film, as for fit,
    and how they move.
    """
    from pairsim.api.folders import plot

    look: dict[str, Any] = {"out": output, "formats": formats, "width": width, "physical": physical, "legend": legend}
    of_film: dict[str, Any] = {"fps": fps, "pixel": pixel, "particles": particles}
    paths = plot(*folders, **look, **of_film, group=group, field=field, animate=animate)
    for path in paths:
        typer.echo(str(path))
    if not paths:
        typer.echo("note: nothing to draw: the folder holds no line of values", err=True)


@app.command(epilog="Examples: pairsim report runs/quickstart | pairsim report runs/sweep")
def report(directory: Folder) -> None:
    """Write DIR/report.html: answer, warnings, pictures, table and provenance on one page.

    One file that needs no network, to send around; of a case or a sweep, finished
    or not. It is replaced where it exists.
    """
    from pairsim.api.report import report

    typer.echo(str(report(directory)))


@app.command(
    epilog="Examples: pairsim moduli M001.rtdc --table lut.txt | pairsim moduli M001.rtdc --table lut.txt "
    '--carrier "0.59% MC-PBS" --celsius 24 -o moduli.csv'
)
def moduli(
    file: Annotated[Path, typer.Argument(help="File of a cytometer (.rtdc).")],
    table: Annotated[Path, typer.Option(help="Look-up table of pairsim table --cytometry, or one of dclab.")],
    carrier: Annotated[
        str | None,
        typer.Option(
            help="Carrier in place of that in the file: 0.49%, 0.59% or 0.83% MC-PBS, or table for that of the table."
        ),
    ] = None,
    celsius: Annotated[
        float | None, typer.Option(help="Temperature of the carrier in degrees Celsius, in place of that in the file.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="CSV file to write (default: FILE-moduli.csv).")
    ] = None,
    overwrite: OverwriteFile = False,
) -> None:
    """Compute Young's modulus of each event of a cytometer by a look-up table, with its half-width.

    Writes a CSV file with a row for each event, in the order of the file, and a
    picture of the events over lines of equal modulus beside it. Moduli of events
    outside of the table are empty.
    """
    from pairsim.api.moduli import moduli as moduli_of
    from pairsim.plots.measured import draw_moduli
    from pairsim.results.folder import write_file

    output = output or Path(f"{file.stem}-moduli.csv")
    if (picture := output.with_suffix(".png")) == output:
        raise InputError("pairsim moduli", "-o", str(output), f"must be a CSV file: the picture is {picture}")
    for path in (output, picture):
        check_free(path, overwrite)
    found = moduli_of(file, table, carrier=carrier, celsius=celsius)
    write_file(output, found.table.to_csv(index=False, float_format="%.6g"))
    draw_moduli(found.table.to_numpy(), found.look_up, picture)
    for sentence in found.sentences:
        typer.echo(sentence)
    typer.echo(f"{output}\n{picture}")

"""Print a table of results, with the unit of each column in the header.

For a run or a curve it has the columns t, d, dU, dU_error and U, with --all
all columns. A terminal shows five digits; a file or a pipe gets CSV with all
digits. Units are um, s, um/s and Pa where the case has a physical block, else
D_c, U_av and D_c/U_av. For a sweep the tables of all cases follow one another,
with the parameters that vary.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

import pairsim
from pairsim.app.options import OverwriteFile, Physical, check_free
from pairsim.record.folder import write_file
from pairsim.runtime.errors import InputError

EXAMPLES = (
    "Examples: pairsim table runs/quickstart | pairsim table runs/case --dimensionless -o series.csv | "
    "pairsim table runs/curve equilibria | pairsim table runs/curve --at 8um | pairsim table runs/sweep equilibria"
)


def table(
    directory: Annotated[Path, typer.Argument(help="Folder of a case or of a sweep.")],
    name: Annotated[
        str | None, typer.Argument(help="A table of the folder, such as equilibria (default: its main one).")
    ] = None,
    physical: Physical = None,
    cytometry: Annotated[
        bool,
        typer.Option(
            "--cytometry", help="For a sweep of shape: the look-up table of moduli for pairsim moduli and dclab."
        ),
    ] = False,
    channel: Annotated[
        Literal["equivalent", "square", "round"],
        typer.Option(
            help="With --cytometry, the channel of the cytometer: a square one, with the moduli of the equivalent tube "
            "(equivalent) or with these corrected for the walls (square), or the tube itself (round)."
        ),
    ] = "equivalent",
    at: Annotated[
        list[str] | None,
        typer.Option(
            "--at", metavar="D", help="For a curve: dU and its error at a distance, such as 8um; may be repeated."
        ),
    ] = None,
    all_: Annotated[bool, typer.Option("--all", help="All columns and, on a terminal, all rows.")] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="CSV file to write (default: print the table).")
    ] = None,
    netcdf: Annotated[Path | None, typer.Option(metavar="FILE", help="For a sweep: netCDF file to write.")] = None,
    overwrite: OverwriteFile = False,
) -> None:
    check_free(output, overwrite)
    check_free(netcdf, overwrite, "--netcdf")
    if channel != "equivalent" and not cytometry:
        raise InputError("pairsim table", "--channel", channel, "must be given with --cytometry")
    if cytometry:
        from pairsim.lab.cytometer.look_up_table import look_up_table

        if given := name or (physical is not None and "--physical"):
            raise InputError("pairsim table", given, None, "must be left out with --cytometry")
        text, notes = look_up_table(directory, channel)
        for note in notes:
            typer.echo(f"note: {note}", err=True)
        _print(text, output)
        return
    from pairsim.record.tables import csv_text, readable, screen_text

    result = pairsim.open(directory)
    if netcdf is not None:
        if not isinstance(result, pairsim.SweepResult):
            raise InputError(str(directory), "--netcdf", None, "must be given with the folder of a sweep")
        write_file(netcdf, bytes(result.to_xarray(name, physical=physical).to_netcdf(engine="scipy")), "--netcdf")
        return typer.echo(str(netcdf))
    found = result.frame(name, physical=physical, at=at or ())
    if at:
        _say_unknown(result)
    if output is None and sys.stdout.isatty():
        typer.echo(screen_text(found, shutil.get_terminal_size().columns, all_))
    else:
        _print(csv_text(readable(found, all_)), output)


def _say_unknown(result: pairsim.SweepResult | pairsim.Result) -> None:
    """Name on stderr the inputs with half-widths whose effect on dU the curves do not have."""
    cases = result.cases if isinstance(result, pairsim.SweepResult) else [result]
    unknown = [each.curve.by_inputs.unknown for each in cases if isinstance(each, pairsim.CurveResult)]
    if keys := list(dict.fromkeys(key for each in unknown for key in each)):
        from pairsim.analysis.input_parts import unknown_in_words

        typer.echo(f"note: {unknown_in_words(keys)}", err=True)


def _print(text: str, output: Path | None) -> None:
    """Write a text to a file, or to stdout."""
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_file(output, text, "-o")
        typer.echo(str(output))

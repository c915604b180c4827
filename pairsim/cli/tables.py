"""Commands that read tables of results: `table` and `travel`.

Large libraries are imported inside the commands, so that --help and input errors are printed at once.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Annotated

import typer

from pairsim.cli.options import OverwriteFile, Physical, check_free, path_argument, path_option, write_file
from pairsim.runtime.errors import InputError

app = typer.Typer()


@app.command(
    epilog="Examples: pairsim table runs/quickstart | pairsim table runs/case --dimensionless -o series.csv | "
    "pairsim table runs/curve equilibria | pairsim table runs/train --tidy | pairsim table runs/sweep equilibria"
)
def table(
    directory: Annotated[Path, path_argument("Folder of a case or of a sweep.")],
    name: Annotated[
        str | None,
        typer.Argument(help="A table of the folder, such as equilibria (default: its main one).", show_default=False),
    ] = None,
    physical: Physical = None,
    tidy: Annotated[
        bool, typer.Option("--tidy", help="A row for each gap: t, gap (from upstream), d, dU and its error.")
    ] = False,
    cytometry: Annotated[
        bool,
        typer.Option("--cytometry", help="Of a sweep of shape: a table of moduli for dclab's register_lut."),
    ] = False,
    all_: Annotated[bool, typer.Option("--all", help="On a terminal: all rows, and columns of the numerics.")] = False,
    output: Annotated[Path | None, path_option("-o", "--output", words="CSV file to write (default: print).")] = None,
    overwrite: OverwriteFile = False,
) -> None:
    """Print a table of results, with the unit of each column in the header.

    On a terminal with five digits and the main columns; into a file or a pipe as
    CSV with all columns and digits. Units are um, s, um/s and Pa where the case has
    a physical block, else D_c, U_av and D_c/U_av. Of a sweep, the tables of all
    cases, one below the other, with the parameters that vary.
    """
    check_free(output, overwrite)
    if cytometry:
        from pairsim.results.cytometry import look_up_table

        if given := name or (physical is not None and "--physical") or (tidy and "--tidy"):
            raise InputError("pairsim table", given, None, "must be left out with --cytometry")
        _print(look_up_table(directory), output)
        return
    import pairsim
    from pairsim.results.tables import csv_text, screen_text

    found = pairsim.open(directory).frame(name, physical=physical, tidy=tidy)
    if output is None and sys.stdout.isatty():
        typer.echo(screen_text(found, shutil.get_terminal_size().columns, all_))
    else:
        _print(csv_text(found), output)


def _print(text: str, output: Path | None) -> None:
    """Write a text to a file, or to stdout."""
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_file(output, text)
        typer.echo(str(output))


@app.command(
    epilog="Examples: pairsim travel runs/curve --from 0.1 --to 0.5 | pairsim travel runs/curve --from 5um --to 25um"
)
def travel(
    directory: Annotated[Path, path_argument("Folder of curve.")],
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
    block, also in s and mm.
    """
    import pairsim
    from pairsim.results.folder import kind_of

    if (kind := kind_of(directory)) != "curve":
        raise InputError(str(directory), "", None, f"must be a folder of `pairsim curve`, not of `pairsim {kind}`")
    typer.echo(str(pairsim.open(directory).travel(start, stop)))

"""Compute Young's modulus of each event of a cytometer by a look-up table, with its half-width.

Writes a CSV file with a row for each event, in the order of the file, and a
picture of the events over lines of equal modulus beside it. Moduli of events
outside of the table are empty.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pairsim
from pairsim.app.options import OverwriteFile, check_free
from pairsim.record.folder import write_file
from pairsim.runtime.errors import InputError

EXAMPLES = (
    "Examples: pairsim moduli M001.rtdc --table lut.txt | pairsim moduli M001.rtdc --table lut.txt "
    '--carrier "0.59% MC-PBS" --celsius 24 -o moduli.csv'
)


def moduli(
    file: Annotated[Path, typer.Argument(help="Cytometer file (.rtdc).")],
    table: Annotated[Path, typer.Option(help="Look-up table from pairsim table --cytometry, or one from dclab.")],
    carrier: Annotated[
        str | None,
        typer.Option(
            help="Carrier, in place of that in the file: 0.49%, 0.59% or 0.83% MC-PBS; or table, for that of the table."
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
    from pairsim.lab.pictures import draw_moduli

    output = output or Path(f"{file.stem}-moduli.csv")
    if (picture := output.with_suffix(".png")) == output:
        raise InputError("pairsim moduli", "-o", str(output), f"must be a CSV file: the picture is {picture}")
    for path in (output, picture):
        check_free(path, overwrite)
    found = pairsim.moduli(file, table, carrier=carrier, celsius=celsius)
    write_file(output, found.table.to_csv(index=False, float_format="%.6g"), "-o")
    draw_moduli(found.table.to_numpy(), found.look_up, picture)
    for sentence in found.sentences:
        typer.echo(sentence)
    typer.echo(f"{output}\n{picture}")

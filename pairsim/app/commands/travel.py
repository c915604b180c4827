"""Compute the time and the length of tube in which a pair moves from one distance to another, from its curve.

The time is the integral of dc/dU [D_c/U_av] over the distance c between the
centres of volume, the length that of U/dU dc with the mean velocity U of the
pair [D_c]; there must be no zero of dU between the distances. Their
half-widths follow from that of dU along the curve. If the case has a physical
block, both are in s and mm. Also prints by how much the time changes for a
pair that starts from rest at the first distance, and by which distance this
start is forgotten; and, where beads differ, which fraction of pairs makes the
travel, and within which length.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import pairsim
from pairsim.record.folder import kind_of
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.analysis.master_curve import Curve

START, STOP = "--from", "--to"
EXAMPLES = "Examples: pairsim travel runs/curve --from 0.1 --to 0.5 | pairsim travel runs/curve --from 5um --to 25um"


def travel(
    directory: Annotated[Path, typer.Argument(help="Folder of pairsim curve.")],
    start: Annotated[
        str, typer.Option(START, metavar="D", help="Initial distance, in tube diameters D_c or with a unit.")
    ],
    stop: Annotated[str, typer.Option(STOP, metavar="D", help="Final distance, in tube diameters D_c or with a unit.")],
) -> None:
    if (kind := kind_of(directory)) != "curve":
        raise InputError(str(directory), "", None, f"must be a folder of `pairsim curve`, not of `pairsim {kind}`")
    typer.echo(travels(pairsim.open(directory).curve, start, stop))


def travels(curve: Curve, start: str, stop: str) -> str:
    """The travel of two equal beads and, where beads differ, those of pairs, in words.

    Raises:
        InputError: A distance is outside the curve; or all beads are equal, and do not make the travel.
    """
    of_pairs = curve.travel_of_pairs(start, stop)
    try:
        lines = [str(curve.travel(start, stop))]
    except InputError as error:
        if of_pairs is None:
            raise
        error.call_arguments({"start": START, "stop": STOP})
        lines = [f"two equal beads do not make this travel: {error.key} {error.allowed}"]
    return "\n".join([*lines, *([str(of_pairs)] if of_pairs is not None else [])])

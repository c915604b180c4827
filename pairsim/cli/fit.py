"""`pairsim fit`: a modulus or a relaxation time from a film of two beads."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer()


@app.command(epilog="Example: pairsim fit film.csv case.yaml")
def fit(
    film: Annotated[Path, typer.Argument(help=r"CSV file with columns such as t \[s] and d \[um].")],
    case: Annotated[Path, typer.Argument(help="Case file with a physical block; what is unknown is a first guess.")],
    unknown: Annotated[list[str] | None, typer.Option(help="modulus (default) or relaxation; repeat for both.")] = None,
    atlas: Annotated[Path | None, typer.Option(help="File of an atlas (default: those that ship).")] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder of a picture, film.png.")] = None,
) -> None:
    """Fit the modulus of two equal beads, or the relaxation time of their liquid, to a film of their distance."""
    from pairsim.api.fit import fit as fit_of

    found = fit_of(film, case, unknown=unknown or ("modulus",), atlas=atlas)
    typer.echo(str(found))
    if output is not None:
        typer.echo(str(*found.plot(output)))

"""Check a law of your own in the same way as those that ship.

It is checked at rest, in shear and extension, and in rotated frames; so are
its Jacobian and, of a liquid, the flow in the tube, for which forms are
compiled the first time (half a minute).

Exit codes: 0 all statements hold, 3 some do not.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pairsim.physics.own_laws import load_file, name_file
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.physics.material import Material

EXAMPLES = "Examples: pairsim check-law my_laws.py:FeneCR L2=20 | pairsim check-law my_laws.py:Gent Jm=1"

WRONG = 3  # exit code where a statement does not hold


def check_law(
    law: Annotated[str, typer.Argument(help="A class in a file, such as my_laws.py:FeneCR.", metavar="FILE:CLASS")],
    numbers: Annotated[
        list[str] | None,
        typer.Argument(help="Parameters, such as L2=20; others have their defaults, or values in their ranges."),
    ] = None,
) -> None:
    import pairsim.runtime.fenicsx  # noqa: F401  # before everything else that loads MPI or is compiled
    from pairsim.solvers.check_law import checks

    chosen = _law_in(law, numbers or ())
    typer.echo(f"{chosen.name}: {', '.join(f'{k} = {v:g}' for k, v in chosen.numbers.items()) or 'no parameters'}")
    wrong = 0
    for check in checks(chosen):
        wrong += not check.holds
        typer.echo(f"{'ok' if check.holds else 'WRONG':6} {check.says}  {check.why or f'(off by {check.off:.1e})'}")
    if wrong:
        raise typer.Exit(WRONG)


def _law_in(place: str, numbers: Sequence[str]) -> Material:
    """A law in a file, with given parameters; InputError if it is not there, or if one of them is out of its range."""
    from pairsim.solvers.check_law import sample

    name, file = (part[::-1] for part in place[::-1].partition(":")[::2])
    if not Path(file).is_file():
        raise InputError("check-law", "", place, "must be a class in a file, such as my_laws.py:FeneCR")
    name_file(Path(file))
    laws = {law.__name__: law for law in load_file(Path(file))}
    if name not in laws:
        raise InputError(file, "", name, f"must be {' or '.join(laws)}")
    declared, given = laws[name].parameters(), dict[str, float]()
    for text in numbers:
        key, _, value = text.partition("=")
        if (p := declared.get(key)) is None:
            raise InputError("check-law", key, value, f"is no parameter of {name}, which has {', '.join(declared)}")
        try:
            given[key] = float(value)
        except ValueError:
            given[key] = float("nan")
        if not p.least <= given[key] <= p.most or (p.open and given[key] == p.least):
            raise InputError("check-law", key, value, f"must be a number from {p.least:g} to {p.most:g}")
    return sample(laws[name], given)

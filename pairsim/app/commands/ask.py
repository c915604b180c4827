"""Say at once whether a pair of beads separates or collides, how fast, and from which distance on.

The answer is read from an atlas of master curves; every +- is the half-width
of an interval, and quantities may have one, too: '5 +- 1 kPa'. Beads may
differ: of two diameters or moduli that of the trailing (upstream) bead comes
first. Distances have units, or are in tube diameters. Where the atlas has no
answer, the command says why, and which computation has one. For the other
quantities of pairsim units, write a case file with units -o.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import pairsim
from pairsim.app.commands.travel import travels
from pairsim.app.options import Settings
from pairsim.app.quantity_options import Text, of_option, quantity
from pairsim.app.question_commands import code_of, draw
from pairsim.cases.physical import QUANTITIES
from pairsim.cases.yaml_file import apply_settings
from pairsim.quantities.kinds import LENGTH, VELOCITY
from pairsim.quantities.text import in_unit
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pydantic import BaseModel

    from pairsim.analysis.master_curve import Curve

EXAMPLES = (
    "Examples: pairsim ask --tube 50um --particle 20um --flow 1ul/min --modulus '5 +- 1 kPa' "
    "--viscosity 1Pa.s --at 8um | pairsim ask --tube 60um --particle 24um,23.5um --flow 1ul/min --modulus 5kPa,7kPa "
    "--viscosity 1Pa.s | pairsim ask case.yaml --from 5um --to 20um --compute"
)


def ask(
    *,
    case: Annotated[
        Path | None, typer.Argument(help="Case file (YAML), in place of --tube and the other quantities.")
    ] = None,
    atlas: Annotated[
        Path | None, typer.Option(help="Atlas file, atlas.npz from pairsim atlas (default: those that ship).")
    ] = None,
    tube: Annotated[Text, quantity(QUANTITIES["tube"])] = None,
    particle: Annotated[list[str] | None, quantity(QUANTITIES["particle"], several=True)] = None,
    flow_rate: Annotated[Text, quantity(QUANTITIES["flow_rate"])] = None,
    velocity: Annotated[Text, quantity(QUANTITIES["velocity"])] = None,
    modulus: Annotated[list[str] | None, quantity(QUANTITIES["modulus"], several=True)] = None,
    young: Annotated[list[str] | None, quantity(QUANTITIES["young"], several=True)] = None,
    viscosity: Annotated[Text, quantity(QUANTITIES["viscosity"])] = None,
    relaxation: Annotated[Text, quantity(QUANTITIES["relaxation"])] = None,
    liquid: Annotated[Text, typer.Option(metavar="LAW", help="Law of the liquid, as in pairsim units.")] = None,
    at: Annotated[
        list[str] | None,
        typer.Option("--at", metavar="D", help="Distance at which dU is wanted, such as 8um; may be repeated."),
    ] = None,
    start: Annotated[
        Text, typer.Option("--from", metavar="D", help="Initial distance of a travel; needs --to.")
    ] = None,
    stop: Annotated[Text, typer.Option("--to", metavar="D", help="Final distance of the travel.")] = None,
    compute: Annotated[
        bool, typer.Option("--compute", help="Where the atlas has no answer, compute it as pairsim curve does.")
    ] = False,
    folder: Annotated[Path | None, typer.Option("-o", "--output", help="Folder for the curve of --compute.")] = None,
    set_: Settings = None,
) -> None:
    options = locals()
    from pairsim.cases.keys import groups_of

    names = [name for name in options if name in QUANTITIES or name == "liquid"]
    given = {name: options[name] for name in names if options[name]}
    for name, values in (("particle", particle), ("modulus", modulus), ("young", young)):
        if values:
            several = [each.strip() for value in values for each in value.split(",")]
            given[name] = several[0] if len(several) == 1 else several
    if case is None and tube is None:
        raise InputError("pairsim ask", "--tube", None, "must be given, or a case file instead")
    if case is not None and given:
        raise _beside_a_file(*next(iter(given.items())))
    if (start is None) != (stop is None):
        raise InputError(
            "pairsim ask", "--from" if start is None else "--to", None, "must be given, too, to compute a travel"
        )
    model: type[BaseModel] = QUESTIONS["curve"].model
    apply_settings(given, tuple(set_ or ()), groups_of(model))
    try:
        answer = pairsim.ask(case, atlas=atlas, compute=compute, folder=folder, progress=compute, **given)
    except InputError as error:
        of_options = (of_option("pairsim ask", each, names) if each.file == "case" else each for each in error.mistakes)
        raise InputError.of_all(of_options) from None
    if answer.folder is not None:  # of a curve that was computed
        draw(answer, answer.folder)
    lines = [answer.answer]
    if code := code_of(answer):
        typer.echo(*lines)
        raise typer.Exit(code)
    curve = answer.curve.named("pairsim ask")
    lines += [_at(curve, curve.distance(place, "--at")) for place in at or ()]
    for option, end in (("--from", start), ("--to", stop)):
        if end is not None:
            curve.distance(end, option)
    typer.echo("\n".join(lines))  # also where the pair does not make the travel
    if start is not None and stop is not None:
        typer.echo(travels(curve, start, stop))


def _beside_a_file(name: str, value: object) -> InputError:
    """The error of a quantity, or a law, that is given beside a case file."""
    option, key = ("--liquid", name) if name == "liquid" else (QUANTITIES[name].option, f"physical.{name}")
    allowed = f"must be left out if a case file is given; --set {key}=... replaces its key"
    return InputError("pairsim ask", option, value, allowed)


def _at(curve: Curve, d: float) -> str:
    """A sentence on dU at a distance [D_c], with its range due to the inputs, and its spread where beads differ."""
    (dU, half_width), drawn = curve(d), curve.drawn
    value = in_unit(curve.scales, VELOCITY, dU, half_width, "+")
    part = "" if drawn is None else f"; with the uncertainty of the inputs {drawn.words(d)}"
    if drawn is not None and (outside := drawn.outside_at(d)):
        part += f" ({outside})"
    if curve.unequal is not None:
        part += f"; with {curve.unequal.words_at(d, curve.scales)}"
    return f"At d = {in_unit(curve.scales, LENGTH, d)}: dU = {value}{part}."

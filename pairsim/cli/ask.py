"""`pairsim ask` and `pairsim fit`: an experiment and an atlas of master curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pairsim.cli.options import Fps, Particles, Pixel, Settings
from pairsim.cli.units import Text, of_option, quantity
from pairsim.runtime.errors import InputError

app = typer.Typer()


@app.command(
    epilog="Examples: pairsim ask --tube 50um --particle 20um --flow 1ul/min --modulus '5 +- 1 kPa' "
    "--viscosity 1Pa.s --at 8um | pairsim ask case.yaml --from 5um --to 20um --compute"
)
def ask(
    *,
    case: Annotated[Path | None, typer.Argument(help="Case file (YAML), in place of --tube and others.")] = None,
    atlas: Annotated[
        Path | None, typer.Option(help="File of an atlas, atlas.npz of pairsim atlas (default: those that ship).")
    ] = None,
    tube: Annotated[Text, quantity("Inner diameter of the tube D_c, such as 50um.")] = None,
    particle: Annotated[list[str] | None, quantity("Diameter of the particles, such as 20um.")] = None,
    flow_rate: Annotated[Text, quantity("Flow rate Q, such as 1ul/min.", "--flow")] = None,
    velocity: Annotated[Text, quantity("Mean velocity of the liquid, in place of --flow, such as 5mm/s.")] = None,
    modulus: Annotated[Text, quantity("Shear modulus G_p (default: rigid), such as 5kPa.")] = None,
    viscosity: Annotated[Text, quantity("Zero-shear viscosity eta_0, solvent included, such as 1Pa.s.")] = None,
    relaxation: Annotated[Text, quantity("Relaxation time lambda, such as 2ms.")] = None,
    liquid: Annotated[Text, typer.Option(metavar="LAW", help="Law of the liquid, as for units.")] = None,
    at: Annotated[
        list[str] | None, typer.Option("--at", metavar="D", help="Distance at which dU is wanted, such as 8um; repeat.")
    ] = None,
    start: Annotated[Text, typer.Option("--from", metavar="D", help="First distance of a travel, with --to.")] = None,
    stop: Annotated[Text, typer.Option("--to", metavar="D", help="Last distance of a travel.")] = None,
    compute: Annotated[
        bool, typer.Option("--compute", help="Where the atlas has no answer, compute it: pairsim curve.")
    ] = False,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder of the curve of --compute.")] = None,
    set_: Settings = None,
) -> None:
    """Say at once whether a pair of equal beads separates or collides, how fast, and from which distance on.

    The answer is read from an atlas of master curves; every +- is that of its
    interval, and quantities may have one: '5 +- 1 kPa'. Distances have units, or
    are in tube diameters. Where the atlas has no answer, the command says why,
    and which computation has one. Other quantities of units: write a case file
    with units -o.
    """
    options = locals()
    from pairsim.api.ask import ask as answer_of
    from pairsim.cases.keys import groups_of
    from pairsim.cases.physical import QUANTITIES
    from pairsim.cases.yaml_file import apply_settings
    from pairsim.computing.case_files import model_of
    from pairsim.quantities.kinds import LENGTH, VELOCITY
    from pairsim.quantities.text import in_unit
    from pairsim.results.inputs import DrawnRange
    from pairsim.results.scales import scales_in
    from pairsim.results.travel import distance_on, travel

    names = [name for name in options if name in QUANTITIES or name == "liquid"]
    given = {name: options[name] for name in names if options[name]}
    if particle:
        given["particle"] = particle[0] if len(particle) == 1 else particle
    if case is None and tube is None:
        raise InputError("pairsim ask", "--tube", None, "must be given, or a case file")
    if case is not None and given:
        name, value = next(iter(given.items()))
        option, key = "--flow" if name == "flow_rate" else f"--{name}", name if name == "liquid" else f"physical.{name}"
        allowed = f"must be left out if a case file is given; --set {key}=... replaces its key"
        raise InputError("pairsim ask", option, value, allowed)
    if relaxation and not (liquid or case):
        raise InputError("pairsim ask", "--liquid", None, "must be given with --relaxation, as for pairsim units")
    if (start is None) != (stop is None):
        raise InputError("pairsim ask", "--from" if start is None else "--to", None, "must be given, too, for a travel")
    apply_settings(given, tuple(set_ or ()), groups_of(model_of("curve")))
    try:
        answer = answer_of(case, atlas=atlas, compute=compute, folder=output, progress=compute, **given)
    except InputError as error:
        of_options = (of_option("pairsim ask", each, names) if each.file == "case" else each for each in error.mistakes)
        raise InputError.of_all(of_options) from None
    scales, drawn = scales_in(answer.record), DrawnRange.of(answer.record)
    lines = [*answer.findings(), *(f"Warning: {warning}" for warning in answer.warnings)]
    for place in at or ():
        d = distance_on(answer.curve.of(), place, "--at", scales, "pairsim ask")
        dU, half_width = answer.curve(d)
        value = in_unit(scales, VELOCITY, dU, half_width, "+")
        part = "" if drawn is None else f"; by the inputs {drawn.words(d)}"
        if drawn is not None and (outside := drawn.outside_at(d)):
            part += f" ({outside})"
        lines.append(f"At d = {in_unit(scales, LENGTH, d)}: dU = {value}{part}.")
    for option, end in (("--from", start), ("--to", stop)):
        if end is not None:
            distance_on(answer.curve.of(), end, option, scales, "pairsim ask")
    typer.echo("\n".join(lines))  # also where the pair does not make the travel
    if start is not None and stop is not None:
        typer.echo(str(travel(answer.columns, start, stop, "pairsim ask", answer.record)))
        if drawn is not None:
            typer.echo("The half-widths of the inputs are not in the +- of this travel.")


@app.command(
    epilog="Examples: pairsim fit film.csv case.yaml | "
    "pairsim fit tracks.csv case.yaml --fps 500 --pixel '.65 +- .01 um' --particles 3,5"
)
def fit(
    film: Annotated[Path, typer.Argument(help=r"Table with columns such as t \[s] and d \[um], or of a tracker.")],
    case: Annotated[Path, typer.Argument(help="Case file with a physical block; what is unknown may be left out.")],
    unknown: Annotated[list[str] | None, typer.Option(help="modulus (default), relaxation or both.")] = None,
    fps: Fps = None,
    pixel: Pixel = None,
    particles: Particles = None,
    exchanged: Annotated[
        Path | None,
        typer.Option(metavar="FILM", help="Second film of the same beads, the other one leading or the flow turned."),
    ] = None,
    atlas: Annotated[Path | None, typer.Option(help="File of an atlas (default: those that ship).")] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder of a picture, film.png.")] = None,
) -> None:
    """Fit the modulus of two beads, or the relaxation time of their liquid, to a film of their distance.

    The interval has what the case does not know exactly: half-widths such as
    particle: 20 +- 0.4 um, and particle_difference: 0 +- 0.5 %, by which the
    leading bead is larger than the trailing one; without it this is unknown.
    Tables of TrackPy, TrackMate, ImageJ and others are read as they are: their
    positions are those of centres, and the case has the diameter.
    """
    typer.echo("fit: trying values over the range of the atlas, some seconds", err=True)
    from pairsim.api.fit import fit as fit_of

    found = fit_of(
        film,
        case,
        unknown=unknown or "modulus",
        exchanged=exchanged,
        atlas=atlas,
        fps=fps,
        pixel=pixel,
        particles=particles,
    )
    typer.echo(str(found))
    if output is not None:
        typer.echo(str(*found.plot(output)))

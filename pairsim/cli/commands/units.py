"""Compute the dimensionless numbers and scales of an experiment; with -o also write a case file.

Every quantity is a number with its unit, such as 50um. Also prints whether
inertia is negligible, a warning if no steady shape is expected, and each
default used.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Annotated, Any

import typer

import pairsim
from pairsim.cases.keys import groups_of
from pairsim.cases.physical import Physical
from pairsim.cases.yaml_file import apply_settings
from pairsim.cli.options import OfQuestion, Settings, check_free
from pairsim.physics import liquids, solids
from pairsim.physics.declared import PARAMETERS
from pairsim.physics.own_laws import file_of
from pairsim.results.folder import write_file
from pairsim.runtime.errors import InputError
from pairsim.sweeps.files import FILES

ENDS = {"ends": "developed", "length": "auto"}
"""What a case is given that says nothing of the ends of its tube."""
Text = str | None
Number = float | None
File = Path | None


def quantity(words: str, *names: str) -> Any:
    """An option that is a quantity with its unit."""
    return typer.Option(*names, metavar="QUANTITY", help=words)


TUBE = quantity("Inner diameter of the tube D_c, such as 50um.")
VISCOSITY = quantity("Zero-shear viscosity eta_0, solvent included, such as 1Pa.s.")
_law = partial(typer.Option, metavar="LAW")
_number = partial(typer.Option, metavar="NUMBER")


EXAMPLES = (
    "Examples: pairsim units --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa --viscosity 1Pa.s "
    "--relaxation 2ms --liquid giesekus -o case.yaml | pairsim units --liquid power-law --n 0.6 "
    "--consistency 0.5Pa.s^0.6 --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa"
)


def units(
    *,
    tube: Annotated[str, TUBE],
    particle: Annotated[list[str], quantity("Diameter of the particles, such as 20um; repeat it, from upstream.")],
    flow_rate: Annotated[Text, quantity("Flow rate Q: U_av = 4 Q/(pi D_c^2), such as 1ul/min.", "--flow")] = None,
    velocity: Annotated[Text, quantity("Mean velocity of the liquid U_av, in place of --flow, such as 5mm/s.")] = None,
    pressure: Annotated[Text, quantity("Pressure drop in place of --flow, such as 20kPa; with --over.")] = None,
    over: Annotated[Text, quantity("Length of tube over which it falls, such as 5cm.")] = None,
    modulus: Annotated[
        list[str] | None, quantity("Shear modulus G_p (default: rigid; repeat for one value each), such as 5kPa.")
    ] = None,
    young: Annotated[list[str] | None, quantity("Young's modulus E = 3 G_p, in place of --modulus.")] = None,
    density: Annotated[Text, quantity("Density of the liquid (default: water), such as 1000kg/m^3.")] = None,
    distance: Annotated[
        list[str] | None,
        quantity(
            "Distance between the surfaces, such as 5um (repeat for one value each gap; with --kind curve, for its "
            "distances; with --kind critical, for the least and the largest one)."
        ),
    ] = None,
    end: Annotated[Text, quantity("End time of the run (default: by De and Ca_e), such as 2ms.")] = None,
    liquid: Annotated[
        Text,
        _law(
            help="Law of the liquid: newtonian, bingham, carreau, fene-p, giesekus, herschel-bulkley, oldroyd-b, "
            "power-law, ptt-linear, ptt-exp, white-metzner, or one of your own."
        ),
    ] = None,
    viscosity: Annotated[Text, VISCOSITY] = None,
    consistency: Annotated[Text, quantity("Consistency K: eta_0 = K (U_av/D_c)^(n - 1), such as 0.5Pa.s^0.6.")] = None,
    plastic_viscosity: Annotated[Text, quantity("Plastic viscosity of a Bingham liquid, such as 1Pa.s.")] = None,
    yield_stress: Annotated[Text, quantity("Yield stress tau_y: Bn = tau_y D_c/(eta_0 U_av), such as 5Pa.")] = None,
    relaxation: Annotated[Text, quantity("Relaxation time lambda: De = lambda U_av/D_c, such as 2ms.")] = None,
    solvent: Annotated[Text, quantity("Viscosity of the solvent eta_s: xi = eta_s/eta_0, such as 1mPa.s.")] = None,
    time_constant: Annotated[Text, quantity("Inverse of the rate where thinning begins, such as 2ms.")] = None,
    viscosity_inf: Annotated[Text, quantity("Viscosity at large shear rates, such as 1mPa.s.")] = None,
    n: Annotated[Number, _number("--n", help="Flow index of the thinning part.")] = None,
    a: Annotated[Number, _number("--a", help="Exponent of the transition; 2 is the law of Carreau.")] = None,
    L2: Annotated[Number, _number("--L2", help="Largest trace of the conformation tensor.")] = None,
    alpha: Annotated[Number, _number("--alpha", help="Mobility of the Giesekus liquid.")] = None,
    epsilon: Annotated[Number, _number("--epsilon", help="Extensional parameter of the PTT liquids.")] = None,
    carrier: Annotated[
        Text, typer.Option(help="Carrier of cytometry in place of --liquid, such as '0.59% MC-PBS'.")
    ] = None,
    celsius: Annotated[float, typer.Option(help="Temperature of the carrier in degrees Celsius.")] = 23.0,
    solid: Annotated[
        Text, _law(help="Law of the particles: neo-hookean, kelvin-voigt, mooney-rivlin, or one of your own.")
    ] = None,
    particle_viscosity: Annotated[Text, quantity("Viscosity of the particles, such as 2Pa.s.")] = None,
    c: Annotated[Number, _number("--c", help="Part of the second invariant in the shear modulus.")] = None,
    rheology: Annotated[
        File,
        typer.Option(help="File of a rheometer with a flow curve (shear rate, viscosity or stress, N1), to be fitted."),
    ] = None,
    spectrum: Annotated[
        File, typer.Option(help="File of a rheometer with moduli (frequency, G', G''), to be fitted.")
    ] = None,
    section: Annotated[
        list[str] | None,
        typer.Option(help="Section of these files to be read, by a part of its name; repeat it for two files."),
    ] = None,
    kind: Annotated[OfQuestion, typer.Option("--kind", help="The command that the case file is for.")] = "run",
    output: Annotated[File, typer.Option("-o", "--output", help="Write a case file to this path.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing case file.")] = False,
    set_: Settings = None,
) -> None:
    options = locals()

    picture = output.with_name(f"{output.stem}-fit.png") if output and (rheology or spectrum) else None
    for path in (output, picture):
        check_free(path, overwrite)
    given = {key: value for key, value in options.items() if key in Physical.model_fields and value}
    quantities = {key: value[0] if len(value) == 1 else value for key, value in given.items()}
    laws: dict[str, Any] = {}
    for place, law, known in (("liquid", liquid, liquids.LAWS), ("solid", solid, solids.LAWS)):
        declared = chain(*(each.parameters().items() for each in known.values() if file_of(each) is None))
        pure = dict.fromkeys(name for name, parameter in declared if parameter.dimension is None)
        numbers = {name: options[name] for name in pure if options.get(name) is not None}
        if law or numbers:
            laws[place] = {"law": law, **numbers} if numbers else law
    if relaxation and not (liquid or rheology or spectrum):
        elastic = ", ".join(name for name, law in liquids.LAWS.items() if issubclass(law, liquids.ConformationLaw))
        allowed = f"must be given with --relaxation: {elastic}; --rheology FILE finds the one that fits a flow curve"
        raise InputError("pairsim units", "--liquid", None, allowed)
    case = {"physical": quantities, **laws, **ENDS}
    apply_settings(case, tuple(set_ or ()), groups_of(FILES[kind]))
    more: dict[str, Any] = {"pressure": pressure, "over": over, "carrier": carrier, "celsius": celsius}
    try:
        found = pairsim.units(
            kind=kind,
            rheology=rheology,
            spectrum=spectrum,
            section=section or (),
            listener=_listener(),
            **more,
            **case.pop("physical"),
            **case,
        )
    except InputError as error:
        raise InputError.of_all(of_option("pairsim units", each) for each in error.mistakes) from None
    unwritten = None
    if output is not None:  # before the answer, which a closed pipe may cut short; the case before its picture
        try:
            write_file(output, found.case_file(output.stem))
            if found.fit and picture:
                from pairsim.plots.measured import draw_fit

                draw_fit(found.fit.fit, found.fit.data, picture)
                typer.echo(f"fit: {picture}")
        except InputError as error:
            unwritten = error
    typer.echo(str(found))
    if output is not None and output.exists():
        typer.echo(str(output))
    if unwritten is not None:
        raise unwritten
    if output is not None:
        typer.echo(f"next: pairsim {kind} {output} --dry-run", err=True)


def _listener() -> Any:
    """What prints sentences as they become known: what was read and fitted, and on stderr what is being done."""
    from pairsim.api.rheometer import Listener

    class Printer(Listener):
        def answer(self, sentence: str) -> None:
            typer.echo(sentence)

        def progress(self, sentence: str) -> None:
            typer.echo(sentence, err=True)

    return Printer()


def of_option(command: str, error: InputError, options: Collection[str] | None = None) -> InputError:
    """The same error of a command with options in place of the keys of a case that they stand for.

    Keys without an option among these, by default of `units`, are set by --set.
    """

    def option(key: re.Match[str]) -> str:
        declared = PARAMETERS.get(key[1])
        dimension = None if declared is None else declared.parameter.dimension
        name = key[1] if dimension is None else dimension.key
        if options is not None and name not in options:
            return f"--set {name}"
        return "--flow" if name == "flow_rate" else f"--{name.replace('_', '-')}"

    key, allowed = (re.sub(r"\b(?:physical|liquid|solid)\.(\w+)", option, text) for text in (error.key, error.allowed))
    key = f"--{key}" if key in ("liquid", "solid", "carrier", "celsius") else key
    return InputError(command, key, error.value, allowed.removesuffix(" in physical"))

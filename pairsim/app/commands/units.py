"""Compute the dimensionless numbers and scales of an experiment; with -o also write a case file.

Every quantity is a number with its unit, such as 50um. Also prints whether
inertia is negligible, a warning if no steady shape is expected, and each
default used.
"""

from __future__ import annotations

from functools import partial
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any

import typer

import pairsim
from pairsim.app.options import OfQuestion, Settings, check_free
from pairsim.app.quantity_options import Text, of_experiment, of_laws, of_option, pure_numbers
from pairsim.cases.keys import groups_of
from pairsim.cases.physical import QUANTITIES
from pairsim.cases.yaml_file import apply_settings
from pairsim.physics import liquids, solids
from pairsim.physics.declared import DIMENSIONS
from pairsim.record.folder import write_file
from pairsim.runtime.errors import InputError
from pairsim.sweeps.files import FILES

ENDS = {"ends": "developed", "length": "auto"}
"""What a case is given that says nothing of the ends of its tube, unless it is a period."""
File = Path | None
_law = partial(typer.Option, metavar="LAW")
_quantity = partial(typer.Option, metavar="QUANTITY")


EXAMPLES = (
    "Examples: pairsim units --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa --viscosity 1Pa.s "
    "--relaxation 2ms --liquid giesekus -o case.yaml | pairsim units --liquid power-law --n 0.6 "
    "--consistency 0.5Pa.s^0.6 --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa"
)


def units(
    *,
    pressure: Annotated[Text, _quantity(help="Pressure drop in place of --flow, such as 20kPa; with --over.")] = None,
    over: Annotated[Text, _quantity(help="Length of tube over which it falls, such as 5cm.")] = None,
    liquid: Annotated[Text, _law(help=f"Law of the liquid: {', '.join(liquids.LAWS)}, or one of your own.")] = None,
    carrier: Annotated[
        Text, typer.Option(help="Carrier of cytometry in place of --liquid, such as '0.59% MC-PBS'.")
    ] = None,
    celsius: Annotated[float, typer.Option(help="Temperature of the carrier in degrees Celsius.")] = 23.0,
    solid: Annotated[Text, _law(help=f"Law of the particles: {', '.join(solids.LAWS)}, or one of your own.")] = None,
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
    **declared: Any,
) -> None:
    picture = output.with_name(f"{output.stem}-fit.png") if output and (rheology or spectrum) else None
    for path in (output, picture):
        check_free(path, overwrite)
    given = {key: value for key, value in declared.items() if key in QUANTITIES and value}
    quantities = {key: value[0] if len(value) == 1 else value for key, value in given.items()}
    laws: dict[str, Any] = {}
    of_liquids = pure_numbers(liquids.LAWS)
    of_solids = [name for name in pure_numbers(solids.LAWS) if name not in of_liquids]
    for place, law, names in (("liquid", liquid, of_liquids), ("solid", solid, of_solids)):
        numbers = {name: declared[name] for name in names if declared.get(name) is not None}
        if law or numbers:
            laws[place] = {"law": law, **numbers} if numbers else law
    memory = liquids.Liquid.OF_POLYMER["De"].dimension
    if memory is not None and memory.key in quantities and not (liquid or rheology or spectrum):
        elastic = ", ".join(name for name, law in liquids.LAWS.items() if issubclass(law, liquids.ConformationLaw))
        allowed = f"must be given with {memory.option}: {elastic}; --rheology FILE finds the one that fits a flow curve"
        raise InputError("pairsim units", "--liquid", None, allowed)
    model = FILES[kind]
    ends = ENDS if model.model_fields["ends"].default == ENDS["ends"] else {}
    case = {"physical": quantities, **laws, **ends}
    apply_settings(case, tuple(set_ or ()), groups_of(model))
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
                from pairsim.lab.pictures import draw_fit

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


def _signature() -> Signature:
    """The options of the command: its own, and those of all quantities and laws, those of a user's own, too."""
    whole = signature(units, eval_str=True)
    own = {name: each for name, each in whole.parameters.items() if name != "declared"}
    of_solids = {p.dimension.key for law in solids.LAWS.values() for p in law.parameters().values() if p.dimension}
    before = {
        "pressure": of_experiment(),
        "carrier": of_laws(liquids.LAWS, DIMENSIONS.keys() - of_solids),
        "rheology": of_laws(solids.LAWS),
    }
    taken, found = {*own}, list[Parameter]()
    for name, each in own.items():
        new = [option for option in before.get(name, ()) if option.name not in taken]
        found += [*new, each]
        taken |= {option.name for option in new}
    return whole.replace(parameters=found)


units.__signature__ = _signature()  # type: ignore[attr-defined]


def _listener() -> Any:
    """What prints sentences as they become known: what was read and fitted, and on stderr what is being done."""
    from pairsim.lab.rheometer.rheology_of_case import Listener

    class Printer(Listener):
        def answer(self, sentence: str) -> None:
            typer.echo(sentence)

        def progress(self, sentence: str) -> None:
            typer.echo(sentence, err=True)

    return Printer()

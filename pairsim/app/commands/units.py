"""Compute the dimensionless numbers and scales of an experiment; with -o also write a case file.

Every quantity is a number with its unit, such as 50um. Also prints whether
inertia is negligible, a warning if no steady shape is expected, and each
default used.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import pairsim
from pairsim.app.options import OfQuestion, Settings, check_free
from pairsim.app.quantity_options import Text, of_experiment, of_laws, of_option, pure_numbers
from pairsim.cases.physical import QUANTITIES
from pairsim.cases.yaml_file import apply_settings
from pairsim.physics import liquids, solids
from pairsim.physics.declared import DIMENSIONS
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import write_file
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain
from pairsim.runtime.text import pasteable

if TYPE_CHECKING:
    from pydantic import BaseModel

    from pairsim.lab.dimensionless_numbers import Units

ENDS = {"ends": "developed", "length": "auto"}
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
    pressure: Annotated[Text, _quantity(help="Pressure drop, in place of --flow, such as 20kPa; needs --over.")] = None,
    over: Annotated[Text, _quantity(help="Length of tube over which the pressure drops by this, such as 5cm.")] = None,
    liquid: Annotated[
        Text,
        _law(
            help=f"Law of the liquid: {', '.join(liquids.LAWS)}, or one of your own "
            f"(default: {liquids.DEFAULT.name} with --relaxation)."
        ),
    ] = None,
    carrier: Annotated[
        Text, typer.Option(help="Carrier of cytometry, in place of --liquid, such as '0.59% MC-PBS'.")
    ] = None,
    celsius: Annotated[float, typer.Option(help="Temperature of the carrier in degrees Celsius.")] = 23.0,
    solid: Annotated[Text, _law(help=f"Law of the particles: {', '.join(solids.LAWS)}, or one of your own.")] = None,
    rheology: Annotated[
        File,
        typer.Option(help="Rheometer file with a flow curve to be fitted (shear rate, viscosity or stress, N1)."),
    ] = None,
    spectrum: Annotated[
        File, typer.Option(help="Rheometer file with moduli to be fitted (frequency, G', G'').")
    ] = None,
    section: Annotated[
        list[str] | None,
        typer.Option(
            help="Section of these files to be read, by a part of its name; repeat it if there are two files."
        ),
    ] = None,
    kind: Annotated[OfQuestion, typer.Option("--kind", help="The command that the case file is for.")] = "run",
    output: Annotated[File, typer.Option("-o", "--output", help="Write a case file to this path.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing case file.")] = False,
    set_: Settings = None,
    **declared: Any,
) -> None:
    from pairsim.cases.keys import groups_of

    picture = output.with_name(f"{output.stem}-fit.png") if output and (rheology or spectrum) else None
    for path in (output, picture):
        check_free(path, overwrite)
    given = {key: value for key, value in declared.items() if key in QUANTITIES and value}
    quantities = {key: value[0] if len(value) == 1 else value for key, value in given.items()}
    model: type[BaseModel] = QUESTIONS[kind].model
    case: dict[str, Plain] = {"physical": quantities, **_laws(liquid, solid, declared), **_ends(model)}
    apply_settings(case, tuple(set_ or ()), groups_of(model))
    try:
        found = pairsim.units(
            kind=kind,
            pressure=pressure,
            over=over,
            rheology=rheology,
            spectrum=spectrum,
            section=section or (),
            listener=_listener(),
            carrier=carrier,
            celsius=celsius,
            **case,
        )
    except InputError as error:
        raise InputError.of_all(of_option("pairsim units", each) for each in error.mistakes) from None
    unwritten = _write(found, output, picture)
    typer.echo(str(found))
    if output is not None and output.exists():
        typer.echo(str(output))
    if unwritten is not None:
        raise unwritten
    if output is not None:
        typer.echo(f"next: pairsim {kind} {pasteable(output)} --dry-run", err=True)


def _laws(liquid: str | None, solid: str | None, numbers: Mapping[str, Plain]) -> Mapping[str, Plain]:
    """The values of `liquid` and `solid` of the case: the name of a law, or a block with its numbers that are given."""
    found: dict[str, Plain] = {}
    of_liquids = pure_numbers(liquids.LAWS)
    of_solids = [name for name in pure_numbers(solids.LAWS) if name not in of_liquids]
    for place, law, names in (("liquid", liquid, of_liquids), ("solid", solid, of_solids)):
        own = {name: numbers[name] for name in names if numbers.get(name) is not None}
        if law or own:
            found[place] = {"law": law, **own} if own else law
    return found


def _ends(model: type[BaseModel]) -> Mapping[str, str]:
    """Keys for the ends of the tube that a case gets; none for kinds of cases whose tube is one period by default."""
    return ENDS if model.model_fields["ends"].default == ENDS["ends"] else {}


def _write(found: Units, output: Path | None, picture: Path | None) -> InputError | None:
    """Write the case file and the picture of the fit, if they are wanted; returns why one could not be written.

    Files are written before the answer is printed, which a closed pipe may cut short, and the case before its picture.
    """
    if output is None:
        return None
    try:
        write_file(output, found.case_file(output.stem), "-o")
        if found.fit and picture:
            from pairsim.lab.pictures import draw_fit

            draw_fit(found.fit.fit, found.fit.data, picture)
            typer.echo(f"fit: {picture}")
    except InputError as error:
        return error
    return None


def _signature() -> Signature:
    """The options of the command: its own, and those of all quantities and laws, including laws of the user."""
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
    """A listener that prints sentences at once: what was read and fitted, and on stderr what is being done."""
    from pairsim.lab.rheometer.rheology_of_case import Listener

    class Printer(Listener):
        def answer(self, sentence: str) -> None:
            typer.echo(sentence)

        def progress(self, sentence: str) -> None:
            typer.echo(sentence, err=True)

    return Printer()

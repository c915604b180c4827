"""`pairsim units`: the dimensionless numbers and scales of an experiment."""

from __future__ import annotations

import re
from collections.abc import Collection
from functools import partial
from inspect import Parameter, signature
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from pairsim.cli.options import OfQuestion, Settings, check_free
from pairsim.runtime.errors import InputError

app = typer.Typer()
ENDS = {"ends": "developed", "length": "auto"}
"""What a case is given that says nothing of the ends of its tube, unless it is a period."""
EPILOG = (
    "Examples: pairsim units --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa --viscosity 1Pa.s "
    "--relaxation 2ms --liquid giesekus -o case.yaml | pairsim units --liquid power-law --n 0.6 "
    "--consistency 0.5Pa.s^0.6 --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa"
)
Text = str | None
File = Path | None


class _OfDeclarations(TyperCommand):
    """The command `units`, whose options are made when they are asked for: `pairsim --help` reads no declarations."""

    @property
    def params(self) -> Any:
        return _command().params

    @params.setter
    def params(self, _: Any) -> None:
        """Those of the function that stands for the command are none."""

    def get_params(self, ctx: Any) -> Any:
        return _command().get_params(ctx)

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        return _command().make_context(info_name, args, parent, **extra)


def quantity(words: str, *names: str) -> Any:
    """An option that is a quantity with its unit."""
    return typer.Option(*names, metavar="QUANTITY", help=words)


_law = partial(typer.Option, metavar="LAW")


def units(
    *,
    pressure: Annotated[Text, quantity("Pressure drop in place of --flow, such as 20kPa; with --over.")] = None,
    over: Annotated[Text, quantity("Length of tube over which it falls, such as 5cm.")] = None,
    liquid: Annotated[Text, _law(help="Law of the liquid: {laws}.")] = None,
    carrier: Annotated[
        Text, typer.Option(help="Carrier of cytometry in place of --liquid, such as '0.59% MC-PBS'.")
    ] = None,
    celsius: Annotated[float, typer.Option(help="Temperature of the carrier in degrees Celsius.")] = 23.0,
    solid: Annotated[Text, _law(help="Law of the particles: {laws}.")] = None,
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
    """Compute the dimensionless numbers and scales of an experiment; with -o also write a case file.

    Every quantity is a number with its unit, such as 50um. Also prints whether
    inertia is negligible, a warning if no steady shape is expected, and each
    default used.
    """
    from pairsim.api.units import units as units_of
    from pairsim.cases.keys import groups_of
    from pairsim.cases.physical import QUANTITIES
    from pairsim.cases.yaml_file import apply_settings
    from pairsim.cli.declared_options import pure_numbers
    from pairsim.computing.case_files import model_of
    from pairsim.physics import liquids, solids
    from pairsim.results.folder import write_file

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
    model = model_of(kind)
    ends = ENDS if model.model_fields["ends"].default == ENDS["ends"] else {}
    case = {"physical": quantities, **laws, **ends}
    apply_settings(case, tuple(set_ or ()), groups_of(model))
    more: dict[str, Any] = {"pressure": pressure, "over": over, "carrier": carrier, "celsius": celsius}
    try:
        found = units_of(
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


def _command() -> Any:
    """The command with the options of all quantities and laws, those of a user's own, too."""
    from pairsim.cli.declared_options import of_experiment, of_laws
    from pairsim.physics import liquids, solids
    from pairsim.physics.declared import DIMENSIONS

    own = {name: each for name, each in signature(units, eval_str=True).parameters.items() if name != "declared"}
    of_solids = {p.dimension.key for law in solids.LAWS.values() for p in law.parameters().values() if p.dimension}
    made = {
        "pressure": of_experiment(),
        "carrier": of_laws(liquids.LAWS, DIMENSIONS.keys() - of_solids),
        "rheology": of_laws(solids.LAWS),
    }
    taken, found = {*own}, list[Parameter]()
    for name, each in own.items():  # made ones stand before some of the others, which keep their names
        new = [option for option in made.get(name, ()) if option.name not in taken]
        found += [*new, each]
        taken |= {option.name for option in new}
    for at, laws in ((own["liquid"], liquids.LAWS), (own["solid"], solids.LAWS)):
        option = _law(help=at.annotation.__metadata__[0].help.format(laws=", ".join([*laws, "or one of your own"])))
        found[found.index(at)] = at.replace(annotation=Annotated[Text, option])

    def command(**options: Any) -> None:
        units(**options)

    command.__signature__ = signature(units).replace(parameters=found)  # type: ignore[attr-defined]
    whole = typer.Typer()
    whole.command("units", help=units.__doc__, epilog=EPILOG)(command)
    return typer.main.get_group(whole).commands["units"]


@app.command("units", cls=_OfDeclarations, help=units.__doc__, epilog=EPILOG)
def _listed() -> None:
    """What stands for the command in lists."""


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
    from pairsim.cases.physical import QUANTITIES
    from pairsim.physics.declared import PARAMETERS

    def option(key: re.Match[str]) -> str:
        declared = PARAMETERS.get(key[1])
        dimension = None if declared is None else declared.parameter.dimension
        name = key[1] if dimension is None else dimension.key
        if options is not None and name not in options:
            return f"--set {name}"
        return QUANTITIES[name].option if name in QUANTITIES else f"--{name.replace('_', '-')}"

    key, allowed = (re.sub(r"\b(?:physical|liquid|solid)\.(\w+)", option, text) for text in (error.key, error.allowed))
    key = f"--{key}" if key in ("liquid", "solid", "carrier", "celsius") else key
    return InputError(command, key, error.value, allowed.removesuffix(" in physical"))

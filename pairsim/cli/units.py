"""Compute the dimensionless numbers and scales of an experiment; with -o also write a case file.

Every quantity is a number with its unit, such as 50um. Also prints whether
inertia is negligible, a warning if no steady shape is expected, and each
default used.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from pairsim.api.units import units as units_of
from pairsim.cases.physical import QUANTITIES
from pairsim.cases.yaml_file import apply_settings
from pairsim.cli.options import OfQuestion, OverwriteFile, Settings, check_free, print_table, write_file
from pairsim.physics import liquids, solids
from pairsim.physics.declared import PARAMETERS
from pairsim.runtime.errors import InputError

app = typer.Typer()
ENDS = {"ends": "developed", "length": "auto"}
"""What a case is given that says nothing of the ends of its tube."""
OPTIONS = {key: f"--{key.replace('_', '-')}" for key in QUANTITIES} | {"flow_rate": "--flow"}
"""The options of quantities by their keys in a `physical` block."""
NUMBERS = {name: each for name, each in PARAMETERS.items() if each.parameter.dimension is None}
"""Parameters of laws that are pure numbers; the others follow from quantities."""
REQUIRED = ("tube", "particle")
Text = str | None
File = Path | None


def _declared() -> Iterator[inspect.Parameter]:
    """An option for each quantity and each of `NUMBERS`, in the words of their declarations."""
    for key, quantity in QUANTITIES.items():
        of, several = quantity.dimension, quantity.many or quantity.gives == "d"
        example = of.example.format(**dict.fromkeys(of.of_unit, 0.6)).replace(" ", "")
        words = f"{of.words}; such as {example}{', may be repeated' if several else ''}"
        yield _option(key, OPTIONS[key], list[str] if several else str, "QUANTITY", words)
    for name, each in NUMBERS.items():
        yield _option(name, f"--{name}", float, "NUMBER", f"{each.parameter.words} ({', '.join(each.laws)})")


def _option(name: str, option: str, kind: Any, metavar: str, words: str) -> inspect.Parameter:
    default: Any = ... if name in REQUIRED else None
    words = f"{words[0].upper()}{words[1:]}."
    declared = typer.Option(default, option, metavar=metavar, help=words)
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=declared, annotation=kind)


def _with_declared(command: Any) -> Any:
    """Put the options of `_declared` in place of the `declared` of a command, before its own."""
    signature = inspect.signature(command, eval_str=True)
    own = (each for each in signature.parameters.values() if each.name != "declared")
    parameters = {each.name: each for each in (*_declared(), *own)}
    command.__signature__ = signature.replace(parameters=list(parameters.values()))
    return command


def _law(of: str, laws: dict[str, Any]) -> Any:
    words = f"Law of the {of}: {', '.join(laws)}, or one of your own."
    return typer.Option(metavar="LAW", help=words)


@app.command(
    "units",
    help=__doc__,
    epilog="Examples: pairsim units --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa --viscosity 1Pa.s "
    "--relaxation 2ms --liquid giesekus -o case.yaml | pairsim units --liquid power-law --n 0.6 "
    "--consistency 0.5Pa.s^0.6 --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa",
)
@_with_declared
def _command(
    *,
    liquid: Annotated[Text, _law("liquid", liquids.LAWS)] = None,
    solid: Annotated[Text, _law("particles", solids.LAWS)] = None,
    pressure: Annotated[
        Text, typer.Option(metavar="QUANTITY", help="Pressure drop in place of --flow, such as 20kPa; with --over.")
    ] = None,
    over: Annotated[
        Text, typer.Option(metavar="QUANTITY", help="Length of tube over which it falls, such as 5cm.")
    ] = None,
    rheology: Annotated[
        File, typer.Option(help="CSV file of a flow curve (shear rate, viscosity, N1), to which the liquid is fitted.")
    ] = None,
    spectrum: Annotated[File, typer.Option(help="CSV file of moduli (angular frequency, G', G''), alike.")] = None,
    kind: Annotated[OfQuestion, typer.Option("--kind", help="The command that the case file is for.")] = "run",
    output: Annotated[File, typer.Option("-o", "--output", help="Write a case file to this path.")] = None,
    overwrite: OverwriteFile = False,
    set_: Settings = None,
    **declared: Any,
) -> None:
    picture = output.with_name(f"{output.stem}-fit.png") if output and (rheology or spectrum) else None
    for path in (output, picture):
        check_free(path, overwrite)
    given = {key: declared[key] for key in QUANTITIES if declared[key]}
    quantities = {key: value[0] if len(value) == 1 else value for key, value in given.items()}
    laws: dict[str, Any] = {}
    for place, law, known in (("liquid", liquid, liquids.LAWS), ("solid", solid, solids.LAWS)):
        numbers = {name: declared.get(name) for name, each in NUMBERS.items() if each.laws[0] in known}
        numbers = {name: value for name, value in numbers.items() if value is not None}
        for name in (name for name in numbers if law not in NUMBERS[name].laws):
            allowed = f"must be left out, or be given with --{place} {' or '.join(NUMBERS[name].laws)}"
            raise InputError("pairsim units", f"--{name}", numbers[name], allowed)
        if law or numbers:
            laws[place] = {"law": law, **numbers} if numbers else law
    if declared["relaxation"] and not (liquid or rheology or spectrum):
        elastic = ", ".join(name for name, law in liquids.LAWS.items() if issubclass(law, liquids.ConformationLaw))
        allowed = f"must be given with --relaxation: {elastic}; --rheology FILE finds the one that fits a flow curve"
        raise InputError("pairsim units", "--liquid", None, allowed)
    case = {"physical": quantities, **laws, **ENDS}
    apply_settings(case, tuple(set_ or ()))
    if spectrum:
        typer.echo("fit: laws of up to four modes, some half a minute", err=True)
    flow = {"pressure": pressure, "over": over}
    try:
        found = units_of(kind=kind, rheology=rheology, spectrum=spectrum, **flow, **case.pop("physical"), **case)
    except InputError as error:
        raise InputError.of_all(map(_of_option, error.mistakes)) from None
    for sentence in found.fit.sentences if found.fit else ():
        typer.echo(sentence)
    if found.fit and picture:
        found.fit.draw(picture)
        typer.echo(f"fit: {picture}")
    if output is not None:  # before the output, which a closed pipe may cut short
        write_file(output, found.case_file(output.stem))
    table = Table(box=None, pad_edge=False, show_header=False)
    for row in (*found.numbers, *found.scales):
        table.add_row(*row)
    print_table(table)
    for note in (*found.notes, *(f"note: {note}" for note in found.case.notes)):
        typer.echo(note)
    if output is not None:
        typer.echo(str(output))
        typer.echo(f"next: pairsim {kind} {output} --dry-run", err=True)


def _of_option(error: InputError) -> InputError:
    """The same error with options in place of the keys of a case that they stand for."""

    def option(key: re.Match[str]) -> str:
        declared = PARAMETERS.get(key[1])
        dimension = None if declared is None else declared.parameter.dimension
        name = key[1] if dimension is None else dimension.key
        return OPTIONS.get(name, f"--{name}")

    key, allowed = (re.sub(r"\b(?:physical|liquid|solid)\.(\w+)", option, text) for text in (error.key, error.allowed))
    return InputError("pairsim units", key, error.value, allowed)

"""`pairsim units`: the dimensionless numbers and scales of an experiment.

Large libraries are imported inside the commands, so that --help and input errors are printed at once.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pairsim.cli.options import OfUnits, check_free, path_option, print_table, usable
from pairsim.commands import COMMANDS
from pairsim.config.physical import QUANTITIES, Quantity
from pairsim.physics import liquids, solids
from pairsim.physics.declared import FLAT, PARAMETERS
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.config.bench_report import BenchReport

app = typer.Typer(add_completion=False)
PURE = [name for name, each in PARAMETERS.items() if each.parameter.dimension is None]
"""Parameters of laws that are pure numbers."""
REQUIRED = ("tube", "particle")
ENDS = {"ends": "developed", "length": "auto"}
"""What a case is given that says nothing of the ends of its tube."""
NAMES = {"flow_rate": "--flow"}
"""Options that are not named after their key."""
HELP = {
    "velocity": "mean velocity of the liquid, in place of --flow",
    "particle": "diameter of the particles (repeat for one value each, from upstream)",
    "modulus": "shear modulus G_p of the particles (default: rigid; repeat for one value each)",
    "young": "Young's modulus E = 3 G_p, in place of --modulus",
    "density": "density of the liquid (default: that of water)",
    "distance": "distance between the surfaces (repeat for one value each gap; with --kind curve, for its distances; "
    "with --kind critical, for the least and the largest one)",
    "end": "end time of the run (default: by De and Ca_e)",
}
"""What options do that the words of their key do not say."""


def _option_of(key: str) -> str:
    return NAMES.get(key, f"--{key.replace('_', '-')}")


def _sentence(words: str) -> str:
    return words[0].upper() + words[1:]


def _of_quantity(each: Quantity) -> Parameter:
    """The option of a key of the `physical` block."""
    of = each.dimension
    example = of.example.format(**dict.fromkeys(of.of_unit, 0.6)).replace(" ", "")
    words = f"{_sentence(HELP.get(each.key, of.words))}; example: {example}."
    option = typer.Option(_option_of(each.key), metavar="QUANTITY", help=words, show_default=False)
    kind: Any = list[str] if each.many or each.gives == "d" else str
    if each.key in REQUIRED:
        return Parameter(each.key, Parameter.KEYWORD_ONLY, annotation=Annotated[kind, option])
    return Parameter(each.key, Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[kind | None, option])


def _of_number(name: str) -> Parameter:
    """The option of a parameter of a law that is a pure number."""
    words = f"{_sentence(PARAMETERS[name].parameter.words)}."
    kind = Annotated[float | None, typer.Option(f"--{name}", metavar="NUMBER", help=words)]
    return Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=kind)


def _with_quantities(function: Callable[..., None]) -> Callable[..., None]:
    """Replace `**given` by an option for each quantity, and one for each pure number of the laws."""
    own = [each for each in signature(function, eval_str=True).parameters.values() if each.name != "given"]
    parameters = [*map(_of_quantity, QUANTITIES.values()), *map(_of_number, PURE), *own]
    function.__signature__ = signature(function).replace(parameters=parameters)  # type: ignore[attr-defined]
    function.__annotations__ = {each.name: each.annotation for each in parameters}
    return function


def _law_of(what: str, laws: Mapping[str, Any]) -> Any:
    return typer.Option(metavar="LAW", help=f"Law of the {what}: {', '.join(laws)}.", show_default=False)


@app.command(
    epilog="Examples: pairsim units --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa --viscosity 1Pa.s "
    "--relaxation 2ms --liquid giesekus -o case.yaml | pairsim units --liquid power-law --n 0.6 "
    "--consistency 0.5Pa.s^0.6 --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa"
)
@_with_quantities
def units(
    *,
    liquid: Annotated[str | None, _law_of("liquid", liquids.LAWS)] = None,
    solid: Annotated[str | None, _law_of("particles", solids.LAWS)] = None,
    kind: Annotated[OfUnits, typer.Option("--kind", help="The command that the case file is for.")] = "run",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write a case file to this path.", callback=usable)
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing case file.")] = False,
    pressure: Annotated[
        str | None,
        typer.Option(metavar="QUANTITY", help="Pressure drop in place of --flow, such as 20kPa; with --over."),
    ] = None,
    over: Annotated[
        str | None, typer.Option(metavar="QUANTITY", help="Length of tube over which it falls, such as 5cm.")
    ] = None,
    rheology: Annotated[
        Path | None,
        path_option(
            "--rheology", words="CSV file of a flow curve: shear rate, viscosity, N1; the liquid is fitted to it."
        ),
    ] = None,
    spectrum: Annotated[
        Path | None, path_option("--spectrum", words="CSV file of moduli: angular frequency, G', G''; alike.")
    ] = None,
    **given: Any,
) -> None:
    """Compute the dimensionless numbers and scales of an experiment; with -o also write a case file.

    Every quantity is a number with its unit, such as 50um. Also prints whether
    inertia is negligible, a warning if no steady shape is expected, and each
    default used.
    """
    from pairsim.config.bench_file import case_text
    from pairsim.config.bench_report import DEFAULTS, bench_report
    from pairsim.inputs.case_files import parse_case

    check_free(output, overwrite)
    fitted: Any = None
    if rheology or spectrum:
        picture = output and output.with_name(f"{output.stem}-fit.png")
        check_free(picture, overwrite)
        fitted, liquid = _fitted(rheology, spectrum, liquid, given, picture)
    if not COMMANDS[kind].distances:
        kinds = " or ".join(name for name, command in COMMANDS.items() if command.distances)
        raise InputError("pairsim units", "--kind", kind, f"must be {kinds}")
    if given["relaxation"] and liquid is None and fitted is None:
        elastic = ", ".join(name for name, law in liquids.LAWS.items() if issubclass(law, liquids.ConformationLaw))
        allowed = f"must be given with --relaxation: {elastic}; --rheology FILE finds the one that fits a flow curve"
        raise InputError("pairsim units", "--liquid", None, allowed)
    quantities = {key: _one(given[key]) for key in QUANTITIES if given[key]} | (fitted or {})
    if "end" in quantities and kind != "run":
        raise InputError("pairsim units", "--end", quantities["end"], f"must be left out with --kind {kind}")
    written: dict[str, Any] = {"physical": quantities, **_laws(None if fitted else liquid, solid, given)}
    if fitted:
        written["liquid"] = liquid
    if len(given["particle"]) != 1:
        written["particles"] = len(given["particle"])
    if not given["modulus"] and not given["young"]:
        written["Ca_e"] = 0
    if "distance" not in quantities:
        written |= COMMANDS[kind].distances
    written |= ENDS

    def case_at(velocity: str | None = None) -> Any:
        block = DEFAULTS | quantities | ({"velocity": velocity} if velocity else {})
        return parse_case(COMMANDS[kind], {**written, "physical": block}, "pairsim units")

    try:
        if pressure is not None or over is not None:
            quantities["velocity"] = _driven_by(pressure, over, given, case_at)
        case = case_at()
    except InputError as error:
        raise _of_options(error) from None
    report = bench_report(case, quantities)
    if output is not None:  # before the output, which a closed pipe may cut short
        _write(output, case_text({"name": output.stem} | written, case, _comments(report, kind)))
    _show(report)
    for note in case.notes:
        typer.echo(f"note: {note}")
    if output is not None:
        typer.echo(str(output))
        typer.echo(f"next: pairsim {kind} {output} --dry-run", err=True)


def _driven_by(pressure: str | None, over: str | None, given: Mapping[str, Any], case_at: Callable[..., Any]) -> str:
    """The mean velocity that a pressure drives.

    Raises:
        InputError: One of both is missing, or the flow is given, too.
    """
    from pairsim.config.pressure import velocity_for

    if pressure is None or over is None:
        option, other = ("--over", "--pressure") if over is None else ("--pressure", "--over")
        allowed = f"must be given with {other}, such as --pressure 20kPa --over 5cm"
        raise InputError("pairsim units", option, None, allowed)
    for key in ("flow_rate", "velocity"):
        if given[key]:
            raise InputError("pairsim units", _option_of(key), given[key], "must be left out with --pressure")
    try:
        return velocity_for(pressure, over, case_at)
    except InputError:
        raise
    except ValueError as error:
        raise InputError("pairsim units", "--pressure", f"{pressure} over {over}", str(error)) from None


def _fitted(
    rheology: Path | None, spectrum: Path | None, law: str | None, given: Mapping[str, Any], picture: Path | None
) -> tuple[dict[str, str], Any]:
    """The quantities and the value of `liquid` that follow from files of a rheometer; says so, and draws the fit.

    Raises:
        InputError: A file cannot be used, or an option says what the fit says.
    """
    from pairsim.inputs.rheometer import keys_of, read_measured, sentences
    from pairsim.physics.rheometry import fits
    from pairsim.plots.rheometry import draw_fit

    data = read_measured(rheology, spectrum)
    if len(data.frequency):
        typer.echo("fit: laws of up to four modes, some half a minute", err=True)
    found = fits(data, [law] if law else None)
    if not found:
        raise InputError("pairsim units", "--liquid", law, "must have fewer parameters than there are points")
    quantities, liquid = keys_of(found[0])
    if given_too := next((key for key in quantities if given.get(key)), None):
        allowed = f"must be left out, as it is fitted: {quantities[given_too]}"
        raise InputError("pairsim units", _option_of(given_too), given[given_too], allowed)
    for sentence in sentences(found, data):
        typer.echo(sentence)
    if picture is not None:
        draw_fit(found[0], data, picture)
        typer.echo(f"fit: {picture}")
    return quantities, liquid


def _laws(liquid: str | None, solid: str | None, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """The keys of the laws and of their pure numbers in a case."""
    blocks: dict[str, dict[str, Any]] = {"liquid": {"law": liquid}, "solid": {"law": solid}}
    flat = {name: numbers[name] for name in FLAT if numbers[name] is not None}
    for name in PURE:
        if name in FLAT or (value := numbers[name]) is None:
            continue
        laws = PARAMETERS[name].laws
        place = next((place for place, block in blocks.items() if block["law"] in laws), None)
        if place is None:
            raise InputError("pairsim units", f"--{name}", value, f"must be left out, or be given with {_either(laws)}")
        blocks[place][name] = value
    return flat | {key: block if len(block) > 1 else block["law"] for key, block in blocks.items() if block["law"]}


def _either(laws: list[str]) -> str:
    return " or ".join(f"--{'liquid' if law in liquids.LAWS else 'solid'} {law}" for law in laws)


def _write(output: Path, text: str) -> None:
    """Write a text file."""
    from pairsim.results.output import write_text

    try:
        write_text(output, text)
    except OSError as error:
        raise InputError(str(output), "-o", None, f"must be a writable file ({error.strerror})") from None


def _one(values: Any) -> Any:
    """A single value in place of a list of one."""
    return values[0] if isinstance(values, list) and len(values) == 1 else values


def _of_options(error: InputError) -> InputError:
    """The same error with options of `pairsim units` in place of keys of the `physical` block."""

    def options(text: str) -> str:
        for name, each in PARAMETERS.items():
            if each.parameter.dimension is None:
                text = re.sub(rf"^{name}$", f"--{name}", text)
            else:
                text = re.sub(rf"^(?:liquid|solid)\.{name}$", f"physical.{each.parameter.dimension.key}", text)
        text = re.sub(r"physical\.(\w+)", lambda key: _option_of(key[1]), text)
        text = re.sub(r"\bwith (liquid|solid): ", r"with --\1 ", text)
        return re.sub(r"\b(?:liquid|solid)\.(\w+)", r"--\1", text)

    found = [InputError(m.file, options(m.key), m.value, options(m.allowed)) for m in error.mistakes]
    return InputError.of_all(found)


def _comments(report: BenchReport, kind: str) -> list[str]:
    numbers = ", ".join(f"{name} {value}" for name, value, _ in report.numbers)
    return [f"Written by pairsim units; pairsim schema {kind} lists all keys.", numbers, *report.warnings]


def _show(report: BenchReport) -> None:
    from rich.table import Table

    table = Table(box=None, pad_edge=False, show_header=False)
    for row in (*report.numbers, *report.scales):
        table.add_row(*row)
    print_table(table)
    typer.echo(report.inertia)
    for default in report.defaults:
        typer.echo(f"default used: {default}")
    for warning in report.warnings:
        typer.echo(f"warning: {warning}")

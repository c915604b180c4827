"""Commands that convert between physical and dimensionless quantities.

Large libraries are imported inside the commands, so that --help and input errors are printed at once.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pairsim.cli.options import OfUnits, print_table, usable
from pairsim.commands import COMMANDS
from pairsim.config.physical import QUANTITIES, Quantity
from pairsim.physics import liquids, solids
from pairsim.physics.declared import FLAT, PARAMETERS
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.config.bench_report import BenchReport

app = typer.Typer()
TABLES = [table for command in COMMANDS.values() for table in command.tables]
PURE = [name for name, each in PARAMETERS.items() if each.parameter.dimension is None]
"""Parameters of laws that are pure numbers."""
REQUIRED = ("tube", "particle")
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
    "--relaxation 2ms -o case.yaml | pairsim units --liquid power-law --n 0.6 --consistency 0.5Pa.s^0.6 --tube 50um "
    "--particle 20um --flow 1ul/min --modulus 5kPa"
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
    **given: Any,
) -> None:
    """Compute the dimensionless numbers and scales of an experiment; with -o also write a case file.

    Every quantity is a number with its unit, such as 50um. Also prints whether
    inertia is negligible, a warning if no steady shape is expected, and each
    default used.
    """
    from pairsim.config.bench_report import DEFAULTS, bench_report
    from pairsim.config.yaml_file import yaml_text
    from pairsim.inputs.case_files import parse_case

    _check_free(output, overwrite)
    quantities = {key: _one(given[key]) for key in QUANTITIES if given[key]}
    if "end" in quantities and kind != "run":
        raise InputError("pairsim units", "--end", quantities["end"], f"must be left out with --kind {kind}")
    written: dict[str, Any] = {"physical": quantities, **_laws(liquid, solid, given)}
    if len(given["particle"]) != 1:
        written["particles"] = len(given["particle"])
    if not given["modulus"] and not given["young"]:
        written["Ca_e"] = 0
    if "distance" not in quantities:
        written |= COMMANDS[kind].distances
    try:
        case = parse_case(COMMANDS[kind], {**written, "physical": DEFAULTS | quantities}, "pairsim units")
    except InputError as error:
        raise _of_options(error) from None
    report = bench_report(case, quantities)
    if output is not None:  # before the output, which a closed pipe may cut short
        body = yaml_text(written, blocks=True)
        _write(output, "".join(f"# {line}\n" for line in _comments(report, kind)) + body)
    _show(report)
    for note in case.notes:
        typer.echo(f"note: {note}")
    if output is not None:
        typer.echo(str(output))
        typer.echo(f"next: pairsim {kind} {output} --dry-run", err=True)


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


def _check_free(output: Path | None, overwrite: bool) -> None:
    if output is not None and output.exists() and not overwrite:
        raise InputError(str(output), "-o", None, "the file exists; use --overwrite or another name")


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
            if each.parameter.dimension is not None:
                text = re.sub(rf"^(?:liquid|solid)\.{name}$", f"physical.{each.parameter.dimension.key}", text)
        text = re.sub(r"physical\.(\w+)", lambda key: _option_of(key[1]), text)
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


@app.command(
    epilog="Examples: pairsim table runs/quickstart | pairsim table runs/case --physical -o series.csv | "
    "pairsim table runs/curve equilibria"
)
def table(
    directory: Annotated[
        Path, typer.Argument(help=f"Folder of {', '.join(COMMANDS)}.", show_default=False, callback=usable)
    ],
    name: Annotated[
        str | None,
        typer.Argument(help=f"{', '.join(TABLES)} (default: the main table of the folder).", show_default=False),
    ] = None,
    physical: Annotated[
        bool, typer.Option("--physical", help="Convert to um, s, um/s and Pa; the case must have a physical block.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="CSV file to write (default: print).", callback=usable)
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing file.")] = False,
) -> None:
    """Print a table of results as CSV, with the unit of each column in the header.

    Units are those of pairsim (D_c, U_av, D_c/U_av) or, with --physical, um, s,
    um/s and Pa.
    """
    from pairsim.results.folders import kind_of
    from pairsim.results.physical_table import table_of

    _check_free(output, overwrite)
    kind = kind_of(directory)
    if kind not in COMMANDS:
        names = " or ".join(COMMANDS)
        raise InputError(str(directory), "", None, f"must be a folder of {names}, not of `pairsim {kind}`")
    tables = COMMANDS[kind].tables
    if name is not None and name not in tables:
        raise InputError(str(directory), "", name, f"must be {' or '.join(tables)}, a table of `pairsim {kind}`")
    text = table_of(directory, name or tables[0], physical)
    if output is None:
        typer.echo(text, nl=False)
        return
    _write(output, text)
    typer.echo(str(output))


@app.command(
    epilog="Examples: pairsim travel runs/curve --from 0.1 --to 0.5 | pairsim travel runs/curve --from 5um --to 25um"
)
def travel(
    directory: Annotated[Path, typer.Argument(help="Folder of curve.", show_default=False, callback=usable)],
    start: Annotated[
        str, typer.Option("--from", metavar="D", help="First distance, in tube diameters D_c or with a unit.")
    ],
    stop: Annotated[
        str, typer.Option("--to", metavar="D", help="Last distance, in tube diameters D_c or with a unit.")
    ],
) -> None:
    """Compute the time and the length of tube in which a pair moves from one distance to another, from its curve.

    The time is the integral of dc/dU [D_c/U_av] over the distance c between the
    centres of volume, the length that of U/dU dc with the mean velocity U of the
    pair [D_c]; there must be no zero of dU between the distances. Their
    half-widths follow from that of dU along the curve. If the case has a physical
    block, also in s and mm.
    """
    from pairsim.config.quantities import QUANTITY
    from pairsim.results.answer import with_error
    from pairsim.results.folders import kind_of, valid_record
    from pairsim.results.physical_table import scales_of
    from pairsim.results.travel import travel_in

    if (kind := kind_of(directory)) != "curve":
        raise InputError(str(directory), "", None, f"must be a folder of `pairsim curve`, not of `pairsim {kind}`")
    typed = {"--from": start, "--to": stop}
    ends = {option: _distance(directory, option, text) for option, text in typed.items()}
    try:
        result = travel_in(directory, *ends.values())
    except InputError as error:
        if error.key not in ends or QUANTITY.fullmatch(typed[error.key].strip()) is None:
            raise
        gives = f"gives d = {ends[error.key]:g}, which {error.allowed}"
        raise InputError(error.file, error.key, typed[error.key], gives) from None
    time, length = with_error(result.time, result.time_error), with_error(result.length, result.length_error)
    typer.echo(
        f"from d = {ends['--from']:g} to {ends['--to']:g}: {time} D_c/U_av and {length} D_c of tube "
        f"(mean velocity {result.length / result.time:.4g} U_av)"
    )
    if "scales" in valid_record(directory):
        scales = scales_of(directory)
        seconds = with_error(result.time * scales.time, result.time_error * scales.time)
        millimetres = 1e3 * scales.length
        tube = with_error(result.length * millimetres, result.length_error * millimetres)
        typer.echo(f"in physical units: {seconds} s and {tube} mm of tube")
    if result.forgotten is not None:
        known = f"from d = {result.forgotten:.3g} on" if result.forgotten < float("inf") else "nowhere on this curve"
        typer.echo(f"the start at d = {ends['--from']:g} is forgotten {known}; until then dU depends on it")


def _distance(directory: Path, option: str, text: str) -> float:
    """A distance in tube diameters from a number or a length with a unit.

    Raises:
        InputError: It is neither, or the case has no `physical` block to convert a length.
    """
    try:
        return float(text)
    except ValueError:
        pass
    from pairsim.config.quantities import LENGTH, si
    from pairsim.results.physical_table import scales_of

    try:
        length = si(text, LENGTH)
    except ValueError as error:
        raise InputError(str(directory), option, text, f"{error}, or a number of tube diameters") from None
    return length / scales_of(directory).length

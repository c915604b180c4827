"""`pairsim units`: the dimensionless numbers and scales of an experiment.

Large libraries are imported inside the commands, so that --help and input errors are printed at once.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pairsim.cli.options import OfQuestion, Settings, check_free, path_option, print_table, write_file
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.api.units import Units
    from pairsim.cases.units_report import UnitsReport

app = typer.Typer()
ENDS = {"ends": "developed", "length": "auto"}
"""What a case is given that says nothing of the ends of its tube."""


def _quantity(words: str, *names: str) -> Any:
    return typer.Option(*names, metavar="QUANTITY", help=words, show_default=False)


def _number(name: str, words: str) -> Any:
    return typer.Option(f"--{name}", metavar="NUMBER", help=words)


@app.command(
    epilog="Examples: pairsim units --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa --viscosity 1Pa.s "
    "--relaxation 2ms --liquid giesekus -o case.yaml | pairsim units --liquid power-law --n 0.6 "
    "--consistency 0.5Pa.s^0.6 --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa"
)
def units(
    *,
    tube: Annotated[str, _quantity("Inner diameter of the tube D_c; example: 50um.")],
    flow: Annotated[
        str | None,
        _quantity("Flow rate Q; gives the mean velocity U_av = 4 Q/(pi D_c^2); example: 1ul/min."),
    ] = None,
    velocity: Annotated[
        str | None, _quantity("Mean velocity of the liquid, in place of --flow; example: 5mm/s.")
    ] = None,
    pressure: Annotated[str | None, _quantity("Pressure drop in place of --flow, such as 20kPa; with --over.")] = None,
    over: Annotated[str | None, _quantity("Length of tube over which it falls, such as 5cm.")] = None,
    particle: Annotated[
        list[str],
        _quantity("Diameter of the particles (repeat for one value each, from upstream); example: 20um."),
    ],
    modulus: Annotated[
        list[str] | None,
        _quantity("Shear modulus G_p of the particles (default: rigid; repeat for one value each); example: 5kPa."),
    ] = None,
    young: Annotated[
        list[str] | None, _quantity("Young's modulus E = 3 G_p, in place of --modulus; example: 15kPa.")
    ] = None,
    density: Annotated[
        str | None, _quantity("Density of the liquid (default: that of water); example: 1000kg/m^3.")
    ] = None,
    distance: Annotated[
        list[str] | None,
        _quantity(
            "Distance between the surfaces (repeat for one value each gap; with --kind curve, for its distances; "
            "with --kind critical, for the least and the largest one); example: 5um."
        ),
    ] = None,
    end: Annotated[str | None, _quantity("End time of the run (default: by De and Ca_e); example: 2ms.")] = None,
    liquid: Annotated[
        str | None,
        typer.Option(
            metavar="LAW",
            help="Law of the liquid: newtonian, carreau, fene-p, giesekus, oldroyd-b, power-law, ptt-linear, ptt-exp, "
            "white-metzner, or one of your own.",
            show_default=False,
        ),
    ] = None,
    viscosity: Annotated[
        str | None,
        _quantity("Zero-shear viscosity of the liquid eta_0, including that of the solvent; example: 1Pa.s."),
    ] = None,
    consistency: Annotated[
        str | None,
        _quantity("Consistency K of the liquid; gives eta_0 = K (U_av/D_c)^(n - 1); example: 0.5Pa.s^0.6."),
    ] = None,
    relaxation: Annotated[
        str | None, _quantity("Relaxation time lambda; gives De = lambda U_av/D_c; example: 2ms.")
    ] = None,
    solvent: Annotated[
        str | None, _quantity("Viscosity of the solvent eta_s; gives xi = eta_s/eta_0; example: 1mPa.s.")
    ] = None,
    time_constant: Annotated[
        str | None, _quantity("Time constant of thinning, the inverse of the rate where it begins; example: 2ms.")
    ] = None,
    viscosity_inf: Annotated[str | None, _quantity("Viscosity at large shear rates; example: 1mPa.s.")] = None,
    n: Annotated[float | None, _number("n", "Flow index of the thinning part.")] = None,
    a: Annotated[float | None, _number("a", "Exponent of the transition; 2 is the law of Carreau.")] = None,
    L2: Annotated[float | None, _number("L2", "Largest trace of the conformation tensor.")] = None,
    alpha: Annotated[float | None, _number("alpha", "Mobility of the Giesekus liquid.")] = None,
    epsilon: Annotated[float | None, _number("epsilon", "Extensional parameter of the PTT liquids.")] = None,
    solid: Annotated[
        str | None,
        typer.Option(
            metavar="LAW",
            help="Law of the particles: neo-hookean, kelvin-voigt, mooney-rivlin, or one of your own.",
            show_default=False,
        ),
    ] = None,
    particle_viscosity: Annotated[str | None, _quantity("Viscosity of the particles; example: 2Pa.s.")] = None,
    c: Annotated[float | None, _number("c", "Part of the second invariant in the shear modulus.")] = None,
    rheology: Annotated[
        Path | None,
        path_option(
            "--rheology", words="CSV file of a flow curve: shear rate, viscosity, N1; the liquid is fitted to it."
        ),
    ] = None,
    spectrum: Annotated[
        Path | None, path_option("--spectrum", words="CSV file of moduli: angular frequency, G', G''; alike.")
    ] = None,
    kind: Annotated[OfQuestion, typer.Option("--kind", help="The command that the case file is for.")] = "run",
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Write a case file to this path.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing case file.")] = False,
    set_: Settings = None,
) -> None:
    """Compute the dimensionless numbers and scales of an experiment; with -o also write a case file.

    Every quantity is a number with its unit, such as 50um. Also prints whether
    inertia is negligible, a warning if no steady shape is expected, and each
    default used.
    """
    from pairsim.api.units import units as units_of
    from pairsim.cases.units_file import case_text
    from pairsim.cases.yaml_file import apply_settings, section_of
    from pairsim.physics import liquids
    from pairsim.results.folder import plain

    check_free(output, overwrite)
    options = {
        "tube": tube,
        "flow_rate": flow,
        "velocity": velocity,
        "particle": particle,
        "modulus": modulus,
        "young": young,
        "density": density,
        "distance": distance,
        "end": end,
        "viscosity": viscosity,
        "consistency": consistency,
        "relaxation": relaxation,
        "solvent": solvent,
        "time_constant": time_constant,
        "viscosity_inf": viscosity_inf,
        "particle_viscosity": particle_viscosity,
    }
    quantities: dict[str, Any] = {}
    for key, value in options.items():
        if value:
            quantities[key] = value[0] if isinstance(value, list) and len(value) == 1 else value
    numbers = {"n": n, "a": a, "L2": L2, "alpha": alpha, "epsilon": epsilon, "c": c}
    laws: dict[str, Any]
    if rheology or spectrum:
        picture = output and output.with_name(f"{output.stem}-fit.png")
        check_free(picture, overwrite)
        fitted, found = _fitted(rheology, spectrum, liquid, quantities, picture)
        quantities |= fitted
        laws = {"liquid": found} | _laws(None, solid, numbers)
    else:
        laws = _laws(liquid, solid, numbers)
        if relaxation and liquid is None:
            elastic = ", ".join(name for name, law in liquids.LAWS.items() if issubclass(law, liquids.ConformationLaw))
            allowed = (
                f"must be given with --relaxation: {elastic}; --rheology FILE finds the one that fits a flow curve"
            )
            raise InputError("pairsim units", "--liquid", None, allowed)
    if end and kind != "run":
        raise InputError("pairsim units", "--end", end, f"must be left out with --kind {kind}")
    section = section_of(quantities | laws | ENDS)
    apply_settings(section, tuple(set_ or ()))
    given: dict[str, Any] = plain(section)
    given |= given.pop("physical", {})  # of --set
    for place in ("liquid", "solid"):
        if isinstance(block := given.get(place), dict) and block.keys() == {"law"}:
            given[place] = block["law"]

    def units_at(**more: str) -> Units:
        return units_of(kind=kind, **given, **more)

    try:
        if pressure is not None or over is not None:
            given["velocity"] = _driven_by(pressure, over, quantities, units_at)
        result = units_at()
    except InputError as error:
        raise _of_options(error) from None
    if output is not None:  # before the output, which a closed pipe may cut short
        head = _comments(result.report, kind)
        write_file(output, case_text({"name": output.stem, **result.written}, result.case, head))
    _show(result.report)
    for note in result.case.notes:
        typer.echo(f"note: {note}")
    if output is not None:
        typer.echo(str(output))
        typer.echo(f"next: pairsim {kind} {output} --dry-run", err=True)


def _driven_by(pressure: str | None, over: str | None, given: Mapping[str, Any], units_at: Callable[..., Units]) -> str:
    """The mean velocity that a pressure drives.

    Raises:
        InputError: One of both is missing, or the flow is given, too.
    """
    from pairsim.cases.pressure import velocity_for

    if pressure is None or over is None:
        option, other = ("--over", "--pressure") if over is None else ("--pressure", "--over")
        allowed = f"must be given with {other}, such as --pressure 20kPa --over 5cm"
        raise InputError("pairsim units", option, None, allowed)
    for key in ("flow_rate", "velocity"):
        if key in given:
            raise InputError("pairsim units", _option_of(key), given[key], "must be left out with --pressure")
    try:
        return velocity_for(pressure, over, lambda velocity: units_at(velocity=velocity).case)
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
    from pairsim.cases.rheometer import keys_of, read_measured, sentences
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


def _laws(liquid: str | None, solid: str | None, numbers: Mapping[str, float | None]) -> dict[str, Any]:
    """The blocks of the laws of a case, each with its pure numbers.

    Raises:
        InputError: A number belongs to another law.
    """
    from pairsim.physics import liquids
    from pairsim.physics.declared import PARAMETERS

    blocks: dict[str, dict[str, Any]] = {"liquid": {"law": liquid}, "solid": {"law": solid}}
    for name, value in numbers.items():
        if value is None:
            continue
        laws = PARAMETERS[name].laws
        block = next((block for block in blocks.values() if block["law"] in laws), None)
        if block is None:
            either = " or ".join(f"--{'liquid' if law in liquids.LAWS else 'solid'} {law}" for law in laws)
            raise InputError("pairsim units", f"--{name}", value, f"must be left out, or be given with {either}")
        block[name] = value
    return {key: block for key, block in blocks.items() if block["law"]}


def _option_of(key: str) -> str:
    return "--flow" if key == "flow_rate" else f"--{key.replace('_', '-')}"


def _of_options(error: InputError) -> InputError:
    """The same error with options of `pairsim units` in place of keys of the `physical` block."""
    from pairsim.physics.declared import PARAMETERS

    def options(text: str) -> str:
        for name, each in PARAMETERS.items():
            if each.parameter.dimension is None:
                text = re.sub(rf"^{name}$", f"--{name}", text)
            else:
                text = re.sub(rf"^(?:liquid|solid)\.{name}$", f"physical.{each.parameter.dimension.key}", text)
        text = re.sub(r"physical\.(\w+)", lambda key: _option_of(key[1]), text)
        text = re.sub(r"\bwith (liquid|solid): ", r"with --\1 ", text)
        return re.sub(r"\b(?:liquid|solid)\.(\w+)", r"--\1", text)

    found = [InputError("pairsim units", options(m.key), m.value, options(m.allowed)) for m in error.mistakes]
    return InputError.of_all(found)


def _comments(report: UnitsReport, kind: str) -> list[str]:
    numbers = ", ".join(f"{name} {value}" for name, value, _ in report.numbers)
    return [f"Written by pairsim units; pairsim schema {kind} lists all keys.", numbers, *report.warnings]


def _show(report: UnitsReport) -> None:
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

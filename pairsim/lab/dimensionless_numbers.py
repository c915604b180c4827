"""The dimensionless numbers and scales of an experiment, and its case file: `units`."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.cases.case import SceneCase
from pairsim.cases.physical import BLOCK, DENSITY, QUANTITIES
from pairsim.cases.quantity_text import si
from pairsim.cases.run_case import Case
from pairsim.cases.values import is_name
from pairsim.cases.yaml_file import Content, yaml_text
from pairsim.computing.warnings import beyond_checked
from pairsim.lab.case_of_experiment import WATER, case_of_experiment
from pairsim.lab.cytometer.suspending_media import extrapolated
from pairsim.lab.focusing_at_once import first_order_focusing
from pairsim.lab.inertia import Inertia
from pairsim.physics.homogeneous import falling_stress
from pairsim.physics.liquids import Liquid
from pairsim.physics.pipe import Pipe
from pairsim.quantities.kinds import LENGTH, TIME
from pairsim.quantities.scales import Scales
from pairsim.quantities.text import in_unit
from pairsim.record.folder import plain
from pairsim.runtime.errors import NoSteadyState

if TYPE_CHECKING:
    from pairsim.lab.rheometer.rheology_of_case import Listener, MeasuredLiquid

COLUMN = 24  # at which comments begin in a case file
FURTHER = re.compile(r"[;:]| \(|, ")  # ends the part of a key's description that is shown in a comment

Row = tuple[str, str, str]  # name, value with unit, and meaning


@dataclass(frozen=True, repr=False)
class Units:
    """The answer of `pairsim units` on an experiment.

    Attributes:
        case: The case, to be given to `run` or another function.
        written: The keys of the case that were given, or were derived from what was given.
        numbers: The dimensionless numbers.
        scales: The units of length, velocity, time and stress, and the flow without particles.
        notes: Whether inertia is negligible, defaults used, and warnings.
        fit: The liquid that was fitted to files of a rheometer; None without such files.
        derived: Of a quantity in `written` that was derived, by its key, the words that say from what.
    """

    case: SceneCase
    written: Content
    numbers: Sequence[Row]
    scales: Sequence[Row]
    notes: Sequence[str]
    fit: MeasuredLiquid | None = None
    derived: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        all_ = [*self.numbers, *self.scales]
        wide = max(19, *(len(name) for name, _, _ in all_))
        rows = [f"{name:<{wide}} {value:<15} {meaning}" for name, value, meaning in all_]
        return "\n".join([*(f"note: {each}" for each in self.case.remarks), *rows, *self.notes])

    def case_file(self, name: str) -> str:
        """The text of a case file with what was given, and comments; the case gets this name if it is a valid one."""
        numbers = ", ".join(f"{name} {value}" for name, value, _ in self.numbers)
        said = [*(self.fit.sentences if self.fit else ()), *self.notes]
        warnings = [note.removeprefix("warning: ") for note in said if note.startswith("warning: ")]
        intervals = self.fit.intervals if self.fit else {}
        head = [f"Written by pairsim units; pairsim schema {self.case.kind} lists all keys.", numbers]
        head += [*self.case.remarks, *warnings]
        lines = [f"# {line}" for line in head]
        for key, value in {**({"name": name} if is_name(name) else {}), **self.written}.items():
            words = {key: type(self.case).model_fields[key].description or ""}
            if key == BLOCK and isinstance(value, Mapping):
                words |= {each: QUANTITIES[each].words for each in value}
            mode = 0
            for line in yaml_text(plain({key: value}), blocks=True).splitlines():
                mode += line.lstrip().startswith("- ")
                entry = line.partition(":")[0].strip(" -'")
                interval = intervals.get(f"{entry}_{mode}", intervals.get(entry)) if key in (BLOCK, "liquid") else None
                meaning = FURTHER.split(words.get(entry, ""))[0]
                source = self.derived.get(entry, "") if key == BLOCK else ""
                comment = ", ".join(filter(None, (meaning, source, interval and f"95 %: {interval}")))
                lines.append(f"{line:{COLUMN - 1}} # {comment}" if comment else line)
        return "\n".join([*lines, ""])


def units(
    *,
    kind: str = "run",
    pressure: str | None = None,
    over: str | None = None,
    rheology: Path | str | None = None,
    spectrum: Path | str | None = None,
    section: str | Sequence[str] = (),
    listener: Listener | None = None,
    carrier: str | None = None,
    celsius: float = 23.0,
    **given: Any,
) -> Units:
    """Compute the dimensionless numbers and scales of an experiment, as `pairsim units` does.

    Args:
        kind: The command that the case is for.
        pressure: Pressure drop in place of the flow rate, such as "20kPa"; may have a half-width.
        over: Length of tube over which it falls, such as "5cm"; may have a half-width.
        rheology: File of a flow curve to which the liquid is fitted: shear rate, viscosity or stress, N1.
        spectrum: File of moduli, likewise: frequency, G', G''.
        section: A part of the name of the section to be read, if a file has several; several names for two files.
        listener: Receives messages while the files are read and fitted.
        carrier: A methyl-cellulose medium of deformability cytometry in place of a liquid, such as "0.59% MC-PBS".
        celsius: Temperature of the carrier, in degrees Celsius.
        given: The keys of a `physical` block, each a text with its unit such as `tube="50um"`, and other keys of a
            case, such as `liquid={"law": "power-law", "n": 0.6}`. Without a modulus the particles are rigid.

    Returns:
        Numbers, scales, defaults and warnings, and the case.

    Raises:
        InputError: A quantity is missing, or is wrong.

    Example:
        >>> beads = pairsim.units(tube="50um", particle="20um", flow_rate="1ul/min", viscosity="1Pa.s", modulus="5kPa")
        >>> pairsim.run(beads.case)
    """
    found = case_of_experiment(
        kind=kind,
        pressure=pressure,
        over=over,
        rheology=rheology,
        spectrum=spectrum,
        section=section,
        listener=listener,
        carrier=carrier,
        celsius=celsius,
        **given,
    )
    case, quantities, keys, fit = found
    scales = case.scales
    assert scales is not None
    Re = scales.reynolds(si(quantities.get(DENSITY.key) or WATER, DENSITY))
    numbers, notes = _numbers(case, Re), [*_notes(case, {**keys, **quantities}, Re)]
    rows, warnings = _of_flow(case.liquid_model, scales, fit, None if carrier is None else celsius)
    written = {BLOCK: quantities, **keys}
    notes += [*warnings, *(f"note: {note}" for note in case.notes)]
    derived = {} if pressure is None else {"velocity": f"from {pressure} over {over}"}
    return Units(case, written, [*numbers], [*_scales(scales), *rows], notes, fit, derived)


def _numbers(case: SceneCase, Re: float) -> Iterator[Row]:
    viscous, modes, soft = case.is_viscous, case.liquid_model.modes, any(case.Ca_es)
    yield "beta", _list(case.beta), "diameter of the particle over that of the tube, D_p/D_c"
    if not viscous:
        yield "De", f"{case.De:.4g}", "Deborah number lambda U_av/D_c"
    yield "Ca_e", _list(case.Ca_e), "elastic capillary number eta_0 U_av/(D_c G_p)"
    if modes:
        yield "xi", f"{case.xi:.4g}", "viscosity of the solvent over that of the liquid"
    if len(modes) > 1:
        yield "time", _list(tuple(mode.time for mode in modes)), "relaxation times of the modes over that in De"
        yield "weight", _list(tuple(mode.weight for mode in modes)), "their parts of the viscosity of the polymer"
    for each in case.declared_parameters:
        if each.value is not None and (soft if each.key.startswith("solid") else modes or viscous):
            yield each.key, f"{each.value:.4g}", each.parameter.words
    if case.n > 1:
        yield *_distances(case), "distance between the surfaces, over the tube diameter"
    yield "Re", f"{Re:.3g}", "Reynolds number rho U_av D_c/eta_0"
    yield "Re beta^2", f"{Re * max(case.betas) ** 2:.3g}", "Reynolds number of a particle"


def _scales(scales: Scales) -> Iterator[Row]:
    yield "length", f"{scales.length * 1e6:.4g} um", "tube diameter D_c"
    yield "velocity", f"{scales.velocity * 1e3:.4g} mm/s", "mean velocity U_av"
    yield "time", f"{scales.time * 1e3:.4g} ms", "D_c/U_av"
    yield "viscosity", f"{scales.viscosity:.4g} Pa s", "eta_0"
    yield "stress", f"{scales.stress:.4g} Pa", "eta_0 U_av/D_c"


def _of_flow(
    liquid: Liquid, scales: Scales, fit: MeasuredLiquid | None, celsius: float | None
) -> tuple[list[Row], list[str]]:
    """Rows on the flow without particles at the wall, and warnings of shear bands and of rates beyond the data.

    The temperature, in degrees Celsius, is that of a named carrier; None without one.
    """
    try:
        flow = Pipe(liquid).steady()
    except NoSteadyState as error:
        return [], [f"warning: {error}"]
    rate, warnings = flow.wall_rate / scales.time, []
    if falls := falling_stress(liquid, flow.wall_rate):
        between = " to ".join(f"{each / scales.time:.3g}" for each in falls)
        bands = "shear bands may form, and there may be no steady flow; a larger solvent viscosity (xi) helps"
        warnings.append(f"warning: the shear stress falls with the shear rate from {between} 1/s: {bands}")
    if fit and rate > 1.001 * (most := max(x.max() for _, x, _ in fit.data.curves)):
        beyond = f"beyond the data, which end at {most:.4g} 1/s: the law is extrapolated"
        warnings.append(f"warning: the shear rate at the wall, {rate:.4g} 1/s, and those at the particles are {beyond}")
    if celsius is not None:
        warnings += [f"warning: {beyond}" for beyond in extrapolated(celsius, rate)]
    rows = [("wall shear rate", f"{rate:.4g} 1/s", "of the flow without particles")]
    if liquid.modes:
        Wi = f"{liquid.longest * flow.wall_rate:.4g}"
        rows.append(("Wi at the wall", Wi, "Weissenberg number, lambda times this rate"))
    rows.append(("wall stress", f"{flow.gradient / 4 * scales.stress:.4g} Pa", "shear stress there"))
    drop = 1e-5 * flow.gradient * scales.stress / scales.length
    return [*rows, ("pressure drop", f"{drop:.4g} kPa/cm", "without particles")], warnings


def _distances(case: SceneCase) -> tuple[str, str]:
    """The key of the distances, and their values."""
    if isinstance(case, Case):
        return "d0", _list(case.d0)
    least, most = case.range_of_d
    return "d", f"{least:.4g} to {most:.4g}"


def _list(value: Any) -> str:
    return ", ".join(f"{entry:.4g}" for entry in (value if isinstance(value, tuple) else (value,)))


def _notes(case: SceneCase, given: Container[str], Re: float) -> Iterator[str]:
    """Whether inertia is negligible, the defaults used for quantities that were not given, and warnings."""
    inertia = Inertia.of(case, Re)
    yield inertia.sentence
    for said in first_order_focusing(case, Re):
        yield f"on the axis: {said}"
    for default in _defaults(case, given):
        yield f"default used: {default}"
    for text in beyond_checked(case):
        yield f"warning: {text}"
    for text in inertia.warnings:
        yield f"warning: {text}"


def _defaults(case: SceneCase, given: Container[str]) -> Iterator[str]:
    modes = case.liquid_model.modes
    if not modes and not case.is_viscous:
        yield "no relaxation time: the liquid is Newtonian (De = 0)"
    elif modes and case.liquid is None:
        parameters = ", ".join(f"{name} = {value:g}" for name, value in modes[0].numbers.items())
        yield f"liquid: {modes[0].name}" + (f" with {parameters}" if parameters else "")
    elif modes:
        for each in case.declared_parameters:
            if each.value is None and not each.key.startswith("solid"):
                yield f"{each.key} = {each.parameter.default:g}"
    if modes and "solvent" not in given:
        yield f"solvent viscosity: xi = {case.xi:g} of the total"
    if "modulus" not in given and "young" not in given:
        yield "no modulus: the particles are rigid (Ca_e = 0)"
    if "distance" not in given and case.n > 1:
        name, values = _distances(case)
        lengths = " to ".join(in_unit(case.scales, LENGTH, d) for d in dict.fromkeys(case.range_of_d))
        yield f"distance between the surfaces: {name} = {values} D_c, {lengths}"
    if isinstance(case, Case) and "end" not in given:
        yield f"end time: {case.time.end:g} D_c/U_av, {in_unit(case.scales, TIME, case.time.end)}"
    if isinstance(case, Case) and "start" not in given:
        yield f"start: {case.start}, as of beads that have been flowing through the tube for a long time"
    if "density" not in given:
        yield f"density: {WATER}"

"""The report of `pairsim units`: dimensionless numbers, scales, validity of the model, and defaults used."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from pairsim.cases.case import Case, SceneCase
from pairsim.cases.checked_range import beyond_checked
from pairsim.cases.materials import declared_in, is_viscous
from pairsim.physics.scales import Scales
from pairsim.runtime.errors import NoSteadyState

WATER = "1000 kg/m^3"
DEFAULTS = {"density": WATER}
SMALL_RE = 1.0
SMALL_PART = 0.1  # inertia is negligible below this fraction of the larger of Ca_e and De
RIGID = "rigid particles in a liquid without a memory keep their distance: only inertia, neglected here, changes it"
INERTIA = "inertia may change the distance as much as the softness of the particles and the elasticity of the liquid"

Row = tuple[str, str, str]
"""Name, value with unit, and meaning."""


class UnitsReport(NamedTuple):
    """The report of `pairsim units`.

    Attributes:
        numbers: The dimensionless numbers.
        scales: The units of length, velocity, time and stress.
        inertia: A sentence on whether inertia is negligible.
        defaults: For each quantity that was not given, the value used.
        warnings: Reasons why the model may not apply or no steady shape may exist.
    """

    numbers: list[Row]
    scales: list[Row]
    inertia: str
    defaults: list[str]
    warnings: list[str]


def units_report(case: SceneCase, given: Mapping[str, Any]) -> UnitsReport:
    """Describe a case that was given in units.

    Args:
        case: The validated case; its `physical` block has a density.
        given: The keys and values of the `physical` block that the user gave.

    Returns:
        The report.
    """
    scales = case.scales
    assert case.physical is not None
    assert scales is not None
    Re = case.physical.reynolds(scales)
    assert Re is not None
    particle_Re, drive = Re * max(case.betas) ** 2, max(*case.Ca_es, case.De)
    small = Re <= SMALL_RE and particle_Re <= SMALL_PART * drive
    comparison = f"Re beta^2 = {particle_Re:.2g} against {drive:.2g}, the larger of Ca_e and De"
    return UnitsReport(
        [
            *_numbers(case),
            ("Re", f"{Re:.3g}", "Reynolds number rho U_av D_c/eta_0"),
            ("Re beta^2", f"{particle_Re:.3g}", "Reynolds number of a particle"),
        ],
        [*_scales(scales), *_at_the_wall(case, scales)],
        f"inertia {'is' if small else 'may not be'} negligible: Re = {Re:.2g}, {comparison}",
        list(_defaults(case, given)),
        [*beyond_checked(case), *_warnings(case, small)],
    )


def _numbers(case: SceneCase) -> Iterator[Row]:
    viscous, modes, soft = is_viscous(dict(case)), case.liquid_model.modes, any(case.Ca_es)
    yield "beta", _list(case.beta), "particle over tube diameter, D_p/D_c"
    if not viscous:
        yield "De", f"{case.De:.4g}", "Deborah number lambda U_av/D_c"
    yield "Ca_e", _list(case.Ca_e), "elastic capillary number eta_0 U_av/(D_c G_p)"
    if modes:
        yield "xi", f"{case.xi:.4g}", "solvent over total viscosity"
    for each in declared_in(dict(case)):
        if each.value is not None and (soft if each.key.startswith("solid") else modes or viscous):
            yield each.key, f"{each.value:.4g}", each.parameter.words
    if case.n > 1:
        yield *_distances(case), "distance between the surfaces over tube diameter"


def _scales(scales: Scales) -> list[Row]:
    return [
        ("length", f"{scales.length * 1e6:.4g} um", "tube diameter D_c"),
        ("velocity", f"{scales.velocity * 1e3:.4g} mm/s", "mean velocity U_av"),
        ("time", f"{scales.time * 1e3:.4g} ms", "D_c/U_av"),
        ("viscosity", f"{scales.viscosity:.4g} Pa s", "eta_0"),
        ("stress", f"{scales.stress:.4g} Pa", "eta_0 U_av/D_c"),
    ]


def _at_the_wall(case: SceneCase, scales: Scales) -> Iterator[Row]:
    """What the liquid without particles does at the wall; nothing where it has no steady flow."""
    from pairsim.physics.pipe import Pipe

    liquid = case.liquid_model
    try:
        flow = Pipe(liquid).steady()
    except NoSteadyState:
        return
    yield "wall shear rate", f"{flow.wall_rate / scales.time:.4g} 1/s", "of the flow without particles"
    if liquid.modes:
        yield "Wi at the wall", f"{liquid.longest * flow.wall_rate:.4g}", "Weissenberg number lambda times this rate"
    yield "wall stress", f"{flow.gradient / 4 * scales.stress:.4g} Pa", "shear stress there"
    yield "pressure drop", f"{1e-5 * flow.gradient * scales.stress / scales.length:.4g} kPa/cm", "without particles"


def _distances(case: SceneCase) -> tuple[str, str]:
    """The key of the distances, and their values."""
    if isinstance(case, Case):
        return "d0", _list(case.d0)
    least, most = case.range_of_d
    return "d", f"{least:.4g} to {most:.4g}"


def _list(value: Any) -> str:
    return ", ".join(f"{entry:.4g}" for entry in (value if isinstance(value, tuple) else (value,)))


def _defaults(case: SceneCase, given: Mapping[str, Any]) -> Iterator[str]:
    modes = case.liquid_model.modes
    if not modes and not is_viscous(dict(case)):
        yield "no relaxation time: the liquid is Newtonian (De = 0)"
    elif modes and case.liquid is None:
        parameters = ", ".join(f"{name} = {value:g}" for name, value in modes[0].numbers.items())
        yield f"liquid: {modes[0].name}" + (f" with {parameters}" if parameters else "")
    elif modes:
        for each in declared_in(dict(case)):
            if each.value is None and not each.key.startswith("solid"):
                yield f"{each.key} = {each.parameter.default:g}"
    if modes and "solvent" not in given:
        yield f"solvent viscosity: xi = {case.xi:g} of the total"
    if "modulus" not in given and "young" not in given:
        yield "no modulus: the particles are rigid (Ca_e = 0)"
    if "distance" not in given:
        name, values = _distances(case)
        yield f"distance between the surfaces: {name} = {values} D_c"
    if isinstance(case, Case) and "end" not in given:
        yield f"end time: {case.time.end:g} D_c/U_av"
    if "density" not in given:
        yield f"density: {WATER}"


def _warnings(case: SceneCase, small_inertia: bool) -> Iterator[str]:
    if not case.liquid_model.modes and not any(case.Ca_es):
        yield RIGID
    elif not small_inertia:
        yield INERTIA

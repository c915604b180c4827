"""The report of `pairsim units`: dimensionless numbers, scales, validity of the model, and defaults used."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pairsim.config.case import Case, SceneCase
from pairsim.config.checked_range import beyond_checked
from pairsim.config.materials import declared_in, is_viscous

WATER = "1000 kg/m^3"
DEFAULTS = {"density": WATER}
# Largest Ca_e with steady shapes of pairs in a Newtonian liquid, by beta (docs/notebook/quasi-steady.md, "Limits").
STEADY_SHAPES = {0.2: 0.33, 0.4: 0.155, 0.6: 0.085}
SMALL_RE = 1.0
SMALL_PART = 0.1  # inertia is negligible below this fraction of the larger of Ca_e and De


@dataclass(frozen=True)
class Row:
    """A line of a table: name, value with unit, and meaning."""

    name: str
    value: str
    meaning: str


@dataclass(frozen=True)
class BenchReport:
    """The report of `pairsim units`.

    Attributes:
        numbers: The dimensionless numbers.
        scales: The units of length, velocity, time and stress.
        inertia: A sentence on whether inertia is negligible.
        defaults: For each quantity that was not given, the value used.
        warnings: Reasons why the model may not apply or no steady shape may exist.
    """

    numbers: tuple[Row, ...]
    scales: tuple[Row, ...]
    inertia: str
    defaults: tuple[str, ...]
    warnings: tuple[str, ...]


def steady_limit(beta: float) -> float:
    """Largest Ca_e with steady shapes at `beta`: log-linear between the measured values, constant beyond them."""
    sizes = sorted(STEADY_SHAPES)
    beta = min(max(beta, sizes[0]), sizes[-1])
    above = next(size for size in sizes if size >= beta)
    below = max(size for size in sizes if size <= beta)
    part = 0.0 if above == below else (beta - below) / (above - below)
    return math.exp((1 - part) * math.log(STEADY_SHAPES[below]) + part * math.log(STEADY_SHAPES[above]))


def bench_report(case: SceneCase, given: Mapping[str, Any]) -> BenchReport:
    """Describe a case that was given in units.

    Args:
        case: The validated case; its `physical` block has a density.
        given: The keys and values of the `physical` block that the user gave.

    Returns:
        The report.
    """
    assert case.physical is not None
    assert case.scales is not None
    scales, Re = case.scales, case.physical.reynolds(case.scales)
    assert Re is not None
    beta, Ca_e = max(case.betas), max(case.Ca_es)
    material = bool(case.liquid_model.modes) or is_viscous(dict(case))
    particle_Re = Re * beta**2
    rows = [
        Row("beta", _list(case.beta), "particle over tube diameter, D_p/D_c"),
        *([] if is_viscous(dict(case)) else [Row("De", f"{case.De:.4g}", "Deborah number lambda U_av/D_c")]),
        Row("Ca_e", _list(case.Ca_e), "elastic capillary number eta_0 U_av/(D_c G_p)"),
        *([Row("xi", f"{case.xi:.4g}", "solvent over total viscosity")] if case.liquid_model.modes else []),
        *(
            Row(each.key, f"{each.value:.4g}", each.parameter.words)
            for each in declared_in(dict(case))
            if each.value is not None and (any(case.Ca_es) if each.key.startswith("solid") else material)
        ),
        *([Row(*_distances(case), "distance between the surfaces over tube diameter")] if case.n > 1 else []),
        Row("Re", f"{Re:.3g}", "Reynolds number rho U_av D_c/eta_0"),
        Row("Re beta^2", f"{particle_Re:.3g}", "Reynolds number of a particle"),
    ]
    names = [
        Row("length", f"{scales.length * 1e6:.4g} um", "tube diameter D_c"),
        Row("velocity", f"{scales.velocity * 1e3:.4g} mm/s", "mean velocity U_av"),
        Row("time", f"{scales.time * 1e3:.4g} ms", "D_c/U_av"),
        Row("viscosity", f"{scales.viscosity:.4g} Pa s", "eta_0"),
        Row("stress", f"{scales.stress:.4g} Pa", "eta_0 U_av/D_c"),
    ]
    drive = max(Ca_e, case.De)
    small = Re <= SMALL_RE and particle_Re <= SMALL_PART * drive
    comparison = f"Re beta^2 = {particle_Re:.2g} against {drive:.2g}, the larger of Ca_e and De"
    inertia = f"inertia {'is' if small else 'may not be'} negligible: Re = {Re:.2g}, {comparison}"
    return BenchReport(tuple(rows), tuple(names), inertia, tuple(_defaults(case, given)), tuple(_warnings(case, small)))


def _distances(case: SceneCase) -> tuple[str, str]:
    """The key of the distances, and their values."""
    if isinstance(case, Case):
        return "d0", _list(case.d0)
    least, most = case.range_of_d
    return "d", f"{least:.4g} to {most:.4g}"


def _list(value: Any) -> str:
    return ", ".join(f"{entry:.4g}" for entry in (value if isinstance(value, tuple) else (value,)))


def _defaults(case: SceneCase, given: Mapping[str, Any]) -> list[str]:
    taken = []
    modes = case.liquid_model.modes
    if not modes and not is_viscous(dict(case)):
        taken.append("no relaxation time: the liquid is Newtonian (De = 0)")
    elif modes and case.liquid is None:
        parameters = ", ".join(f"{name} = {value:g}" for name, value in modes[0].numbers.items())
        taken.append(f"liquid: {modes[0].name}" + (f" with {parameters}" if parameters else ""))
    elif modes:
        own = [each for each in declared_in(dict(case)) if each.value is None and each.key.partition(".")[0] != "solid"]
        taken += [f"{each.key} = {each.parameter.default:g}" for each in own]
    if modes and "solvent" not in given:
        taken.append(f"solvent viscosity: xi = {case.xi:g} of the total")
    if "modulus" not in given and "young" not in given:
        taken.append("no modulus: the particles are rigid (Ca_e = 0)")
    if "distance" not in given:
        name, values = _distances(case)
        taken.append(f"distance between the surfaces: {name} = {values} D_c")
    if isinstance(case, Case) and "end" not in given:
        taken.append(f"end time: {case.time.end:g} D_c/U_av")
    if "density" not in given:
        taken.append(f"density: {WATER}")
    return taken


def _warnings(case: SceneCase, small_inertia: bool) -> list[str]:
    warnings = beyond_checked(case)
    for beta, Ca_e in sorted(set(zip(case.betas, case.Ca_es, strict=True))):
        if Ca_e > (limit := steady_limit(beta)):
            warnings.append(
                f"Ca_e = {Ca_e:.3g} exceeds about {limit:.2g}, the largest value at which pairs of beta {beta:.3g} had "
                "steady shapes in a Newtonian liquid: the particles may stretch without limit"
            )
    if not case.liquid_model.modes and not any(case.Ca_es):
        warnings.append(
            "rigid particles in a liquid without a memory keep their distance: only inertia, neglected here, changes it"
        )
    elif not small_inertia:
        warnings.append(
            "inertia may change the distance as much as the softness of the particles and the elasticity of the liquid"
        )
    return warnings

"""The `physical` block of a case: quantities of an experiment, and the dimensionless numbers computed from them.

De = lambda U_av/D_c and Ca_e = eta_0 U_av/(D_c G_p) with U_av = 4 Q/(pi D_c^2), as in Esposito, D'Avino and Villone
(2024).
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pairsim.config.mistakes import Mistake, missing
from pairsim.config.quantities import (
    DENSITY,
    FLOW,
    LENGTH,
    STRESS,
    TIME,
    VELOCITY,
    VISCOSITY,
    Density,
    Distances,
    FlowRate,
    Kind,
    Length,
    Modulus,
    Time,
    Velocity,
    Viscosity,
    distance_texts,
    rounded,
    si,
)
from pairsim.config.values import is_finite
from pairsim.physics.scales import Scales, mean_velocity

BLOCK = "physical"
YOUNG_OVER_SHEAR = 3.0  # incompressible material: E = 3 G_p
INSTEAD = {"beta": "particle", "Ca_e": "modulus", "d0": "distance", "d": "distance"}
"""For each key of a case that the block can replace, the key of the block."""
SAME = 1e-9  # relative tolerance at which two numbers count as equal


class Physical(BaseModel):
    """Quantities of an experiment. particle, modulus, young: one value for all particles, or a list from upstream."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    tube: Length = Field(description="inner diameter of the tube D_c")
    viscosity: Viscosity = Field(description="zero-shear viscosity of the liquid eta_0, including that of the solvent")
    flow_rate: FlowRate | None = Field(None, description="flow rate Q; gives the mean velocity U_av = 4 Q/(pi D_c^2)")
    velocity: Velocity | None = Field(None, description="mean velocity of the liquid U_av, in place of flow_rate")
    particle: Length | tuple[Length, ...] | None = Field(None, description="diameter D_p; gives beta = D_p/D_c")
    modulus: Modulus | tuple[Modulus, ...] | None = Field(
        None,
        description="shear modulus G_p; gives Ca_e = eta_0 U_av/(D_c G_p); for rigid particles give Ca_e: 0 instead",
    )
    young: Modulus | tuple[Modulus, ...] | None = Field(
        None, description="Young's modulus E = 3 G_p, in place of modulus"
    )
    relaxation: Time | None = Field(
        None, description="relaxation time lambda; gives De = lambda U_av/D_c, which is 0 (Newtonian) without it"
    )
    solvent: Viscosity | None = Field(None, description="viscosity of the solvent eta_s; gives xi = eta_s/eta_0")
    density: Density | None = Field(None, description="density of the liquid, only used for the Reynolds number")
    distance: Distances | None = Field(
        None, description="distance between the facing surfaces; gives d0 of a run, d of curve and critical"
    )
    end: Time | None = Field(None, description="end time of a run; gives time.end")

    @property
    def scales(self) -> Scales:
        """The units of length, velocity and stress in SI units."""
        length = si(self.tube, LENGTH)
        if self.velocity is not None:
            velocity = si(self.velocity, VELOCITY)
        else:
            assert self.flow_rate is not None  # ensured by check_physical
            velocity = mean_velocity(si(self.flow_rate, FLOW), length)
        return Scales(length, velocity, si(self.viscosity, VISCOSITY))

    @property
    def reynolds(self) -> float | None:
        """Reynolds number rho U_av D_c/eta_0, None if no density is given."""
        return None if self.density is None else self.scales.reynolds(si(self.density, DENSITY))

    def numbers(self) -> dict[str, tuple[str, Any]]:
        """The dimensionless numbers computed from the block.

        Returns:
            For each dotted key of a case (`d` for `d` and `d0`): the key of the block, and the number or tuple.
        """
        scales = self.scales
        found: dict[str, tuple[str, Any]] = {}

        def each(value: Any, kind: Kind, number: Callable[[float], float]) -> Any:
            if isinstance(value, tuple):
                return tuple(each(entry, kind, number) for entry in value)
            return rounded(number(si(value, kind)))

        if self.particle is not None:
            found["beta"] = "particle", each(self.particle, LENGTH, lambda D_p: D_p / scales.length)
        if self.relaxation is not None:
            found["De"] = "relaxation", each(self.relaxation, TIME, lambda relaxation: relaxation / scales.time)
        if self.modulus is not None:
            found["Ca_e"] = "modulus", each(self.modulus, STRESS, lambda G_p: scales.stress / G_p)
        if self.young is not None:
            found["Ca_e"] = "young", each(self.young, STRESS, lambda E: YOUNG_OVER_SHEAR * scales.stress / E)
        if self.solvent is not None:
            found["xi"] = "solvent", each(self.solvent, VISCOSITY, lambda eta_s: eta_s / scales.viscosity)
        if self.distance is not None:
            distances = each(distance_texts(self.distance), LENGTH, lambda d: d / scales.length)
            found["d"] = "distance", distances if isinstance(self.distance, tuple | dict) else distances[0]
        if self.end is not None:
            found["time.end"] = "end", each(self.end, TIME, lambda end: end / scales.time)
        return found


def check_physical(physical: Physical) -> Iterator[Mistake]:
    """Check the keys of the block against each other; yields mistakes."""
    for one, other in (("flow_rate", "velocity"), ("modulus", "young")):
        if (value := getattr(physical, other)) is not None and getattr(physical, one) is not None:
            yield Mistake(f"{BLOCK}.{other}", value, f"must be left out if {BLOCK}.{one} is given")
    if physical.flow_rate is None and physical.velocity is None:
        yield missing(f"{BLOCK}.flow_rate", f"must be given, or else {BLOCK}.velocity")
    if physical.solvent is not None and si(physical.solvent, VISCOSITY) > si(physical.viscosity, VISCOSITY):
        allowed = f"must be at most {BLOCK}.viscosity = {physical.viscosity}, which includes it"
        yield Mistake(f"{BLOCK}.solvent", physical.solvent, allowed)


class Translation:
    """The keys and values of a case with the numbers of its `physical` block filled in.

    Args:
        data: The case as given, with lists as tuples.
        fields: Keys that this kind of case has.

    Attributes:
        data: The case with the numbers; unchanged if there is no `physical` block or it has mistakes.
        mistakes: Inconsistent keys of the block, and keys of the case that contradict it.
        origins: For each number filled in, the dotted key of the block that it was computed from.
    """

    def __init__(self, data: Mapping[str, Any], fields: Mapping[str, Any]) -> None:
        self.data, self.origins = dict(data), dict[str, str]()
        self.mistakes: list[Mistake] = []
        physical = read_block(data)
        if physical is None:
            return
        self.mistakes += check_physical(physical)
        if self.mistakes:
            return
        self.data = copy.deepcopy(self.data)
        for key, (origin, number) in physical.numbers().items():
            self._fill("d0" if key == "d" and "d0" in fields else key, f"{BLOCK}.{origin}", number, fields)
        if "De" not in self.data and physical.relaxation is None:
            self.data["De"] = 0.0

    def _fill(self, key: str, origin: str, number: Any, fields: Mapping[str, Any]) -> None:
        group, _, name = key.rpartition(".")
        inner = self.data.setdefault(group, {}) if group else self.data
        if (group or name) not in fields:
            self.mistakes.append(Mistake(origin, None, f"must be left out: this kind of case has no {key}"))
            self.data.pop(group, None)
        elif not isinstance(inner, dict):
            return  # rejected by the validation
        elif inner.get(name) is not None and not same(inner[name], number):
            allowed = f"must be left out, or be {shown(number)} as given by {origin}"
            self.mistakes.append(Mistake(key, inner[name], allowed))
        else:
            inner[name] = number
            self.origins[key] = origin

    def at_origin(self, mistake: Mistake) -> Mistake:
        """Turn a mistake in a number that was filled in into one of the key of the block that it was computed from."""
        key = mistake.key.partition("[")[0]
        if mistake.is_missing and BLOCK in self.data and key in INSTEAD:
            return Mistake(key, None, f"{mistake.allowed}, or be given by {BLOCK}.{INSTEAD[key]}")
        if key not in self.origins or mistake.value is None:
            return mistake
        origin = self.origins[key]
        given = getattr(read_block(self.data), origin.removeprefix(f"{BLOCK}."))
        return Mistake(origin, given, f"gives {mistake.key} = {shown(mistake.value)}, which {mistake.allowed}")


def read_block(data: Mapping[str, Any]) -> Physical | None:
    """The validated `physical` block; None if it is absent or invalid, which the validation of the case reports."""
    try:
        return Physical.model_validate(data[BLOCK]) if BLOCK in data else None
    except ValidationError:
        return None


def forget_numbers(data: dict[str, Any]) -> None:
    """Remove from a case, as read from a folder of results, the numbers computed from its `physical` block.

    They would contradict the block after a change of it. Numbers that differ from those of the block are kept, so that
    the contradiction is reported.
    """
    physical = read_block(tuples(data))
    if physical is None or any(check_physical(physical)):
        return
    for key, (_, number) in physical.numbers().items():
        for name in ("d", "d0") if key == "d" else (key,):
            group, _, last = name.rpartition(".")
            inner = data.get(group) if group else data
            if isinstance(inner, dict) and inner.get(last) is not None and same(tuples(inner[last]), number):
                del inner[last]
    if physical.relaxation is None and data.get("De") == 0:
        del data["De"]


def same(given: Any, number: Any) -> bool:
    """Whether two numbers, or two lists of numbers, are equal within the relative tolerance `SAME`."""
    if isinstance(given, tuple) or isinstance(number, tuple):
        many = [value if isinstance(value, tuple) else (value,) for value in (given, number)]
        return len(many[0]) == len(many[1]) and all(same(a, b) for a, b in zip(*many, strict=True))
    return is_finite(given) and math.isclose(given, number, rel_tol=SAME)


def shown(number: Any) -> str:
    """A number or a list of numbers as text for a message."""
    if isinstance(number, tuple | list):
        return f"[{', '.join(map(shown, number))}]"
    return f"{number:.4g}" if is_finite(number) else str(number)


def tuples(value: Any) -> Any:
    """Convert lists within nested data to tuples, as the models expect."""
    if isinstance(value, dict):
        return {key: tuples(entry) for key, entry in value.items()}
    return tuple(map(tuples, value)) if isinstance(value, list) else value

"""The `physical` block of a case: what is on the bench, and the dimensionless numbers that it becomes.

De = lambda U_av/D_c, Ca_e = eta_0 U_av/(D_c G_p) with U_av = 4 Q/(pi D_c^2), as in Esposito, D'Avino and Villone.
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
    si,
)
from pairsim.physics.scales import Scales, mean_velocity

BLOCK = "physical"
YOUNG_OVER_SHEAR = 3.0  # of an incompressible material: E = 3 G_p
INSTEAD = {"beta": "particle", "Ca_e": "modulus", "d0": "distance", "d": "distance"}
"""Keys of the block that stand for keys of a case which may be missing."""
SAME = 1e-9  # numbers that agree to this part are the same


class Physical(BaseModel):
    """What is on the bench. particle, modulus, young: the same for all particles, or a list counted from upstream."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    tube: Length = Field(description="inner diameter of the tube D_c")
    viscosity: Viscosity = Field(description="zero-shear viscosity of the liquid eta_0, that of the solvent included")
    flow_rate: FlowRate | None = Field(None, description="flow rate Q; gives the mean velocity U_av = 4 Q/(pi D_c^2)")
    velocity: Velocity | None = Field(None, description="mean velocity of the liquid U_av, in place of flow_rate")
    particle: Length | tuple[Length, ...] | None = Field(None, description="diameter D_p; gives beta = D_p/D_c")
    modulus: Modulus | tuple[Modulus, ...] | None = Field(
        None, description="shear modulus G_p; gives Ca_e = eta_0 U_av/(D_c G_p); rigid particles have Ca_e: 0 instead"
    )
    young: Modulus | tuple[Modulus, ...] | None = Field(
        None, description="Young's modulus E = 3 G_p, in place of modulus"
    )
    relaxation: Time | None = Field(
        None, description="relaxation time lambda; gives De = lambda U_av/D_c, which is 0 (Newtonian) without it"
    )
    solvent: Viscosity | None = Field(None, description="viscosity of the solvent eta_s; gives xi = eta_s/eta_0")
    density: Density | None = Field(None, description="density of the liquid, for the Reynolds number alone")
    distance: Distances | None = Field(None, description="distance between surfaces; gives d0 of a run, d of the rest")
    end: Time | None = Field(None, description="end time of a run; gives time.end")

    @property
    def scales(self) -> Scales:
        """The units of pairsim in SI units."""
        length = si(self.tube, LENGTH)
        if self.velocity is not None:
            velocity = si(self.velocity, VELOCITY)
        else:
            assert self.flow_rate is not None  # check_physical sees to it
            velocity = mean_velocity(si(self.flow_rate, FLOW), length)
        return Scales(length, velocity, si(self.viscosity, VISCOSITY))

    @property
    def reynolds(self) -> float | None:
        """Reynolds number rho U_av D_c/eta_0, None without a density."""
        return None if self.density is None else self.scales.reynolds(si(self.density, DENSITY))

    def numbers(self) -> dict[str, tuple[str, Any]]:
        """The dimensionless numbers that it becomes.

        Returns:
            For each dotted key of a case (`d` stands for `d0` too) the key here that it comes from, and its value.
        """
        scales = self.scales
        found: dict[str, tuple[str, Any]] = {}

        def each(value: Any, kind: Kind, number: Callable[[float], float]) -> Any:
            if isinstance(value, tuple):
                return tuple(each(entry, kind, number) for entry in value)
            return number(si(value, kind))

        if self.particle is not None:
            found["beta"] = "particle", each(self.particle, LENGTH, lambda D_p: D_p / scales.length)
        if self.relaxation is not None:
            found["De"] = "relaxation", si(self.relaxation, TIME) / scales.time
        if self.modulus is not None:
            found["Ca_e"] = "modulus", each(self.modulus, STRESS, lambda G_p: scales.stress / G_p)
        if self.young is not None:
            found["Ca_e"] = "young", each(self.young, STRESS, lambda E: YOUNG_OVER_SHEAR * scales.stress / E)
        if self.solvent is not None:
            found["xi"] = "solvent", si(self.solvent, VISCOSITY) / scales.viscosity
        if self.distance is not None:
            distances = each(distance_texts(self.distance), LENGTH, lambda d: d / scales.length)
            found["d"] = "distance", distances if isinstance(self.distance, tuple | dict) else distances[0]
        if self.end is not None:
            found["time.end"] = "end", si(self.end, TIME) / scales.time
        return found


def check_physical(physical: Physical) -> Iterator[Mistake]:
    """What no key of the block can say alone."""
    for one, other in (("flow_rate", "velocity"), ("modulus", "young")):
        if (value := getattr(physical, other)) is not None and getattr(physical, one) is not None:
            yield Mistake(f"{BLOCK}.{other}", value, f"must be left out beside {BLOCK}.{one}")
    if physical.flow_rate is None and physical.velocity is None:
        yield missing(f"{BLOCK}.flow_rate", f"give it, or {BLOCK}.velocity")
    if physical.solvent is not None and si(physical.solvent, VISCOSITY) > si(physical.viscosity, VISCOSITY):
        allowed = f"must be at most {BLOCK}.viscosity, which includes it, {physical.viscosity}"
        yield Mistake(f"{BLOCK}.solvent", physical.solvent, allowed)


class Translation:
    """A case's data with the numbers of its physical block filled in.

    Args:
        data: The case as given, lists as tuples.
        fields: Keys that this kind of case has.

    Attributes:
        data: The case with the numbers; as given where there is no such block or it has mistakes.
        mistakes: Of the block: what does not go together, and keys that the case gives otherwise as well.
        origins: For each number that was filled in, the dotted key that it comes from.
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
            return  # the model refuses it
        elif inner.get(name) is not None and not same(inner[name], number):
            words = f"must be left out, or be {shown(number)}, which {origin} makes it"
            self.mistakes.append(Mistake(key, inner[name], words))
        else:
            inner[name] = number
            self.origins[key] = origin

    def told(self, mistake: Mistake) -> Mistake:
        """A mistake in a number that was filled in, as one of the key that it comes from."""
        key = mistake.key.partition("[")[0]
        if mistake.is_missing and BLOCK in self.data and key in INSTEAD:
            return Mistake(key, None, f"{mistake.allowed}, or {BLOCK}.{INSTEAD[key]}")
        if key not in self.origins or mistake.value is None:
            return mistake
        origin = self.origins[key]
        given = getattr(read_block(self.data), origin.removeprefix(f"{BLOCK}."))
        return Mistake(origin, given, f"makes {mistake.key} {shown(mistake.value)}, which {mistake.allowed}")


def read_block(data: Mapping[str, Any]) -> Physical | None:
    """The physical block of a case, None where there is none or it has wrong keys: those are for the case's model."""
    try:
        return Physical.model_validate(data[BLOCK]) if BLOCK in data else None
    except ValidationError:
        return None


def forget_numbers(data: dict[str, Any]) -> None:
    """Take out of a case, as read from a folder of results, the numbers that its physical block has become.

    A change of the block would leave them behind otherwise. Numbers that differ from the block's stay, to be refused.
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
    """Whether numbers or lists of them agree."""
    if isinstance(given, tuple) or isinstance(number, tuple):
        many = [value if isinstance(value, tuple) else (value,) for value in (given, number)]
        return len(many[0]) == len(many[1]) and all(same(a, b) for a, b in zip(*many, strict=True))
    numeric = isinstance(given, int | float) and not isinstance(given, bool)
    return numeric and math.isclose(given, number, rel_tol=SAME)


def shown(number: Any) -> str:
    """A number, or a list of them, in a message."""
    if isinstance(number, tuple | list):
        return f"[{', '.join(map(shown, number))}]"
    return f"{number:.4g}" if isinstance(number, int | float) else str(number)


def tuples(value: Any) -> Any:
    """Plain data with its lists as tuples, as the models take them."""
    if isinstance(value, dict):
        return {key: tuples(entry) for key, entry in value.items()}
    return tuple(map(tuples, value)) if isinstance(value, list) else value

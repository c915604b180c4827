"""The `physical` block of a case: quantities of an experiment, and the dimensionless numbers computed from them.

De = lambda U_av/D_c and Ca_e = eta_0 U_av/(D_c G_p) with U_av = 4 Q/(pi D_c^2), as in Esposito, D'Avino and Villone
(2024).
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from pairsim.config.materials import declared_in, liquid_block
from pairsim.config.mistakes import Mistake, missing
from pairsim.config.quantities import (
    DENSITY,
    FLOW,
    LENGTH,
    STRESS,
    TIME,
    VELOCITY,
    Density,
    Distances,
    FlowRate,
    Kind,
    Length,
    Modulus,
    Time,
    Velocity,
    distance_texts,
    quantity,
    rounded,
    si,
)
from pairsim.config.values import is_finite
from pairsim.physics import liquids
from pairsim.physics.declared import DIMENSIONS
from pairsim.physics.liquids import Liquid, Newtonian, ViscousLaw
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.material import Dimension
from pairsim.physics.scales import Scales, mean_velocity
from pairsim.physics.solids.solid import MODULUS

BLOCK = "physical"
YOUNG_OVER_SHEAR = 3.0  # incompressible material: E = 3 G_p
INSTEAD = {"beta": "particle", "Ca_e": "modulus", "d0": "distance", "d": "distance"}
"""For each key of a case that the block can replace, the key of the block."""
SAME = 1e-9  # relative tolerance at which two numbers count as equal


class _Experiment(BaseModel):
    """The keys of an experiment that do not depend on the materials."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    tube: Length = Field(description="inner diameter of the tube D_c")
    flow_rate: FlowRate | None = Field(None, description="flow rate Q; gives the mean velocity U_av = 4 Q/(pi D_c^2)")
    velocity: Velocity | None = Field(None, description="mean velocity of the liquid U_av, in place of flow_rate")
    particle: Length | tuple[Length, ...] | None = Field(None, description="diameter D_p; gives beta = D_p/D_c")
    modulus: Modulus | tuple[Modulus, ...] | None = Field(None, description=MODULUS.words)
    young: Modulus | tuple[Modulus, ...] | None = Field(
        None, description="Young's modulus E = 3 G_p, in place of modulus"
    )
    density: Density | None = Field(None, description="density of the liquid, only used for the Reynolds number")
    distance: Distances | None = Field(
        None, description="distance between the facing surfaces; gives d0 of a run, d of curve and critical"
    )
    end: Time | None = Field(None, description="end time of a run; gives time.end")


def _fields() -> dict[str, Any]:
    """The fields of the quantities of materials."""
    return {
        key: (quantity(kind_of(each)) | None, Field(None, description=each.words)) for key, each in DIMENSIONS.items()
    }


def kind_of(dimension: Dimension, numbers: Mapping[str, Any] | None = None) -> Kind:
    """The kind of quantity of a dimension; of any unit if that depends on parameters that are not given.

    Args:
        dimension: The dimension.
        numbers: The parameters of its law.
    """
    known = {name: numbers[name] for name in dimension.of_unit if numbers and name in numbers}
    if len(known) < len(dimension.of_unit):
        return Kind(dimension.kind, "", dimension.example)
    return Kind(dimension.kind, dimension.unit.format(**known), dimension.example.format(**known))


if TYPE_CHECKING:

    class _WithMaterials(_Experiment):
        solvent: str | None

else:
    _WithMaterials = create_model("_WithMaterials", __base__=_Experiment, **_fields())


class Physical(_WithMaterials):
    """Quantities of an experiment. particle, modulus, young: one value for all particles, or a list from upstream."""

    def scales(self, case: Mapping[str, Any]) -> Scales:
        """The units of length, velocity and stress in SI units.

        Args:
            case: The case, whose other keys need not be validated yet.
        """
        length = si(self.tube, LENGTH)
        if self.velocity is not None:
            velocity = si(self.velocity, VELOCITY)
        else:
            assert self.flow_rate is not None  # ensured by check_physical
            velocity = mean_velocity(si(self.flow_rate, FLOW), length)
        law = viscosity_law(case)
        value = si(getattr(self, law.measured.key), kind_of(law.measured, law.numbers))
        return Scales(length, velocity, law.unit_viscosity(value, velocity / length))

    def reynolds(self, scales: Scales) -> float | None:
        """Reynolds number rho U_av D_c/eta_0, None if no density is given."""
        return None if self.density is None else scales.reynolds(si(self.density, DENSITY))

    def numbers(self, case: Mapping[str, Any]) -> dict[str, tuple[str, Any]]:
        """The dimensionless numbers computed from the block.

        Args:
            case: The case, whose other keys need not be validated yet.

        Returns:
            For each dotted key of a case (`d` for `d` and `d0`): the key of the block, and the number or tuple.
        """
        scales = self.scales(case)
        found: dict[str, tuple[str, Any]] = {}

        def each(value: Any, kind: Kind, number: Callable[[float], float]) -> Any:
            if isinstance(value, tuple):
                return tuple(each(entry, kind, number) for entry in value)
            return rounded(number(si(value, kind)))

        if self.particle is not None:
            found["beta"] = "particle", each(self.particle, LENGTH, lambda D_p: D_p / scales.length)
        if self.modulus is not None:
            found["Ca_e"] = "modulus", each(self.modulus, STRESS, lambda G_p: scales.stress / G_p)
        if self.young is not None:
            found["Ca_e"] = "young", each(self.young, STRESS, lambda E: YOUNG_OVER_SHEAR * scales.stress / E)
        for key, dimension in keys_of_materials(case):
            if dimension is not None and (value := getattr(self, dimension.key)) is not None:
                own = scales
                if key.startswith("liquid.solvent.") and "xi" in found:  # in units of the solvent's own viscosity
                    own = replace(scales, viscosity=found["xi"][1] * scales.viscosity)
                number = partial(_number, dimension, own)
                found[key] = dimension.key, each(value, kind_of(dimension), number)
        if self.distance is not None:
            distances = each(distance_texts(self.distance), LENGTH, lambda d: d / scales.length)
            found["d"] = "distance", distances if isinstance(self.distance, tuple | dict) else distances[0]
        if self.end is not None:
            found["time.end"] = "end", each(self.end, TIME, lambda end: end / scales.time)
        return found


def _number(dimension: Dimension, scales: Scales, value: float) -> float:
    return dimension.number(value, scales)


def viscosity_law(case: Mapping[str, Any]) -> ViscousLaw:
    """The law that gives the unit of viscosity of a case, which need not be validated yet."""
    block = liquid_block(case)
    law = liquids.LAWS.get(block["law"])
    if law is None or not issubclass(law, ViscousLaw):
        return Newtonian()
    known = {name: block[name] for name in law.parameters() if is_finite(block.get(name))}
    return law.anyhow().with_numbers(known)


def keys_of_materials(case: Mapping[str, Any]) -> Iterator[tuple[str, Dimension | None]]:
    """The dotted keys of the parameters of the materials of a case, and the dimension that each follows from."""
    yield from ((key, parameter.dimension) for key, parameter in Liquid.OF_POLYMER.items())
    yield from ((each.key, each.parameter.dimension) for each in declared_in(case))


def check_physical(physical: Physical, case: Mapping[str, Any]) -> Iterator[Mistake]:
    """Check the keys of the block against each other and against the laws of the case; yields mistakes."""
    for one, other in (("flow_rate", "velocity"), ("modulus", "young")):
        if (value := getattr(physical, other)) is not None and getattr(physical, one) is not None:
            yield Mistake(f"{BLOCK}.{other}", value, f"must be left out if {BLOCK}.{one} is given")
    if physical.flow_rate is None and physical.velocity is None:
        yield missing(f"{BLOCK}.flow_rate", f"must be given, or else {BLOCK}.velocity")
    law = viscosity_law(case)
    measured = law.measured
    unknown = [name for name in measured.of_unit if not is_finite(liquid_block(case).get(name))]
    if unknown:
        yield from (missing(f"liquid.{name}", "must be a number, with liquid: {law: ...}") for name in unknown)
        return
    given = getattr(physical, measured.key)
    if given is None:
        yield missing(f"{BLOCK}.{measured.key}", f"must be given in {BLOCK}")
        return
    try:
        eta = si(given, kind_of(measured, law.numbers))
    except ValueError as error:
        yield Mistake(f"{BLOCK}.{measured.key}", given, str(error))
        return
    places: dict[str, list[str]] = {}
    for key, dimension in keys_of_materials(case):
        if dimension is not None and key.startswith("liquid.") and getattr(physical, dimension.key) is not None:
            places.setdefault(dimension.key, []).append(key)
    for key, of in places.items():
        if len(of) > 1:
            allowed = f"must be left out: it would stand for {' and '.join(of)}, which are to be given"
            yield Mistake(f"{BLOCK}.{key}", getattr(physical, key), allowed)
    taken = {measured.key, *(dimension.key for _, dimension in keys_of_materials(case) if dimension is not None)}
    for key, dimension in DIMENSIONS.items():
        if key not in taken and (value := getattr(physical, key)) is not None:
            allowed = f"must be left out: the laws of this case need no {key} ({dimension.words})"
            yield Mistake(f"{BLOCK}.{key}", value, allowed)
    if measured is ZERO_SHEAR and physical.solvent is not None and si(physical.solvent, kind_of(ZERO_SHEAR)) > eta:
        allowed = f"must be at most {BLOCK}.{measured.key} = {given}, which includes it"
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
        given: Keys of materials that the block has quantities for.
    """

    def __init__(self, data: Mapping[str, Any], fields: Mapping[str, Any]) -> None:
        self.data, self.origins = dict(data), dict[str, str]()
        self.mistakes: list[Mistake] = []
        self._instead = dict(INSTEAD)
        self.given: set[str] = set()
        physical = read_block(data)
        if physical is None:
            return
        for key, dimension in keys_of_materials(data):
            if dimension is not None:
                self._instead[key] = dimension.key
                self.given |= {key} if getattr(physical, dimension.key) is not None else set()
        self.mistakes += check_physical(physical, data)
        if self.mistakes:
            return
        self.data = copy.deepcopy(self.data)
        if isinstance(solid := self.data.get("solid"), tuple):
            self.data["solid"] = tuple({"law": each} if isinstance(each, str) else each for each in solid)
        for key, (origin, number) in physical.numbers(data).items():
            self._fill("d0" if key == "d" and "d0" in fields else key, f"{BLOCK}.{origin}", number, fields)
        self.data.setdefault("De", 0.0)

    def _fill(self, key: str, origin: str, number: Any, fields: Mapping[str, Any]) -> None:
        first = re.split(r"[.\[]", key)[0]
        if first not in fields:
            self.mistakes.append(Mistake(origin, None, f"must be left out: this kind of case has no {key}"))
            self.data.pop(first, None)
            return
        inner, name = group_of(self.data, key)
        if inner is None:
            return  # rejected by the validation
        if inner.get(name) is not None and not same(inner[name], number):
            allowed = f"must be left out, or be {shown(number)} as given by {origin}"
            self.mistakes.append(Mistake(key, inner[name], allowed))
        else:
            inner[name] = number
            self.origins[key] = origin

    def at_origin(self, mistake: Mistake) -> Mistake:
        """Turn a mistake in a number that was filled in into one of the key of the block that it was computed from."""
        key = mistake.key if mistake.key in self.origins else mistake.key.partition("[")[0]
        if mistake.is_missing and BLOCK in self.data and mistake.key in self._instead:
            return Mistake(mistake.key, None, f"{mistake.allowed}, or be given by {BLOCK}.{self._instead[mistake.key]}")
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
    given = tuples(data)
    physical = read_block(given)
    if physical is None or any(check_physical(physical, given)):
        return
    numbers = physical.numbers(given)
    for key, (_, number) in numbers.items():
        for name in ("d", "d0") if key == "d" else (key,):
            inner, last = group_of(data, name)
            if inner is not None and inner.get(last) is not None and same(tuples(inner[last]), number):
                del inner[last]
    if "De" not in numbers and data.get("De") == 0:
        del data["De"]


def group_of(data: dict[str, Any], key: str) -> tuple[dict[str, Any] | None, str]:
    """The group of keys that a dotted key is in, and its name there; a missing group is added.

    The name of a law becomes its block. The group is None if there is another value in its place.
    """
    *groups, name = re.findall(r"[^.\[\]]+", key)
    inner: Any = data
    for group in groups:
        at: Any = int(group) if isinstance(inner, list | tuple) else group
        if isinstance(inner, list | tuple) and isinstance(inner[at], dict):
            inner = inner[at]
            continue
        if not isinstance(inner, dict):
            return None, name
        if isinstance(inner.get(at), str):
            inner[at] = {"law": inner[at]}
        inner = inner.setdefault(at, {})
    return (inner if isinstance(inner, dict) else None), name


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

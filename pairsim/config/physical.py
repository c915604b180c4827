"""The `physical` block of a case: quantities of an experiment, and the dimensionless numbers computed from them.

De = lambda U_av/D_c and Ca_e = eta_0 U_av/(D_c G_p) with U_av = 4 Q/(pi D_c^2), as in Esposito, D'Avino and Villone
(2024).
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from pairsim.config.materials import declared_in, liquid_block
from pairsim.config.mistakes import Mistake, missing
from pairsim.config.quantities import a_length, converted, distances, known_unit, many, quantity, rounded, si
from pairsim.config.values import is_finite
from pairsim.physics import liquids
from pairsim.physics.declared import DIMENSIONS
from pairsim.physics.liquids import Liquid, Newtonian, ViscousLaw
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.material import Dimension, a_time
from pairsim.physics.scales import Scales, mean_velocity
from pairsim.physics.solids.solid import MODULUS

BLOCK = "physical"
SAME = 1e-9  # relative tolerance at which two numbers count as equal


class Quantity(NamedTuple):
    """A key of the block.

    Attributes:
        dimension: Its dimension, which has the name of the key.
        gives: Dotted key of the case that it stands for (`d` for `d` and `d0`), "" if there is none.
        many: Whether it takes one value for each particle.
    """

    dimension: Dimension
    gives: str = ""
    many: bool = False

    @property
    def key(self) -> str:
        """Its name."""
        return self.dimension.key

    @property
    def field(self) -> Any:
        """Type and description of the field."""
        one = distances(self.dimension) if self.gives == "d" else quantity(self.dimension)
        kind = one | many(one) if self.many else one
        words = self.dimension.words
        return (kind, Field(description=words)) if self.key == "tube" else (kind | None, Field(None, description=words))


def _measured(key: str, kind: str, words: str, unit: str, example: str, symbol: str) -> Quantity:
    """A quantity that sets a scale, and is no number of the case."""
    return Quantity(Dimension(key, kind, words, unit, example, lambda value, _: value, symbol))


# An incompressible material has E = 3 G_p.
YOUNG = replace(
    MODULUS,
    key="young",
    words="Young's modulus E = 3 G_p, in place of modulus",
    example="15 kPa",
    symbol="E",
    number=lambda E, scales: 3 * scales.stress / E,
)
DISTANCE = a_length(
    "distance", "distance between the facing surfaces; gives d0 of a run, d of curve and critical", "5 um", "d"
)
DENSITY = _measured(
    "density", "a density", "density of the liquid, only used for the Reynolds number", "kg/m^3", "1000 kg/m^3", r"\rho"
)
EXPERIMENT = (
    Quantity(a_length("tube", "inner diameter of the tube D_c", symbol="D_c")),
    _measured(
        "flow_rate",
        "a flow rate",
        "flow rate Q; gives the mean velocity U_av = 4 Q/(pi D_c^2)",
        "m^3/s",
        "1 ul/min",
        "Q",
    ),
    _measured(
        "velocity", "a velocity", "mean velocity of the liquid U_av, in place of flow_rate", "m/s", "5 mm/s", "U_{av}"
    ),
    Quantity(a_length("particle", "diameter D_p; gives beta = D_p/D_c", "20 um", "D_p"), "beta", many=True),
    Quantity(MODULUS, "Ca_e", many=True),
    Quantity(YOUNG, "Ca_e", many=True),
    DENSITY,
    Quantity(DISTANCE, "d"),
    Quantity(a_time("end", "end time of a run; gives time.end"), "time.end"),
)
QUANTITIES = {each.key: each for each in (*EXPERIMENT, *map(Quantity, DIMENSIONS.values()))}
"""All keys of the block: those of an experiment, then those that the parameters of materials follow from."""

if TYPE_CHECKING:
    _Keys = BaseModel
else:
    _Keys = create_model(
        "_Keys",
        __config__=ConfigDict(extra="forbid", frozen=True, defer_build=True),
        **{key: each.field for key, each in QUANTITIES.items()},
    )


class Physical(_Keys):
    """Quantities of an experiment. particle, modulus, young: one value for all particles, or a list from upstream."""

    @property
    def given(self) -> dict[str, Any]:
        """The quantities that are given, by key."""
        return {key: value for key, value in self if value is not None}

    def scales(self, case: Mapping[str, Any]) -> Scales:
        """The units of length, velocity and stress in SI units.

        Args:
            case: The case, whose other keys need not be validated yet.
        """
        known = {key: si(self.given[key], QUANTITIES[key].dimension) for key in _OF_FLOW if key in self.given}
        length = known["tube"]
        velocity = known["velocity"] if "velocity" in known else mean_velocity(known["flow_rate"], length)
        law = viscosity_law(case)
        value = si(self.given[law.measured.key], known_unit(law.measured, law.numbers))
        return Scales(length, velocity, law.unit_viscosity(value, velocity / length))

    def reynolds(self, scales: Scales) -> float | None:
        """Reynolds number rho U_av D_c/eta_0, None if no density is given."""
        given = self.given.get(DENSITY.key)
        return None if given is None else scales.reynolds(si(given, DENSITY.dimension))

    def numbers(self, case: Mapping[str, Any]) -> dict[str, tuple[str, Any]]:
        """The dimensionless numbers computed from the block.

        Args:
            case: The case, whose other keys need not be validated yet.

        Returns:
            For each dotted key of a case (`d` for `d` and `d0`): the key of the block, and the number or tuple.
        """
        scales, given = self.scales(case), self.given
        found: dict[str, tuple[str, Any]] = {}
        for key, of in stands_for(case):
            if of.key not in given:
                continue
            # A solvent is in units of its own viscosity.
            of_solvent = key.startswith("liquid.solvent.") and "xi" in found
            own = replace(scales, viscosity=found["xi"][1] * scales.viscosity) if of_solvent else scales

            def number(text: str, of: Dimension = of, own: Scales = own) -> float:
                return rounded(of.number(si(text, of), own))

            found[key] = of.key, converted(given[of.key], number)
        return found


_OF_FLOW = ("tube", "flow_rate", "velocity")


def viscosity_law(case: Mapping[str, Any]) -> ViscousLaw:
    """The law that gives the unit of viscosity of a case, which need not be validated yet."""
    block = liquid_block(case)
    law = liquids.LAWS.get(block["law"])
    if law is None or not issubclass(law, ViscousLaw):
        return Newtonian()
    known = {name: block[name] for name in law.parameters() if is_finite(block.get(name))}
    return law.anyhow().with_numbers(known)


def stands_for(case: Mapping[str, Any]) -> list[tuple[str, Dimension]]:
    """The dotted keys of a case that the block can replace, and the dimension that each follows from."""
    of_materials = [(key, each.dimension) for key, each in Liquid.OF_POLYMER.items()]
    of_materials += [(each.key, each.parameter.dimension) for each in declared_in(case)]
    own = [(each.gives, each.dimension) for each in EXPERIMENT if each.gives]
    return own + [(key, dimension) for key, dimension in of_materials if dimension is not None]


def check_physical(physical: Physical, case: Mapping[str, Any]) -> Iterator[Mistake]:
    """Check the keys of the block against each other and against the laws of the case; yields mistakes."""
    given = physical.given

    def wrong(key: str, allowed: str) -> Mistake:
        return Mistake(f"{BLOCK}.{key}", given[key], allowed)

    for one, other in (("flow_rate", "velocity"), ("modulus", "young")):
        if one in given and other in given:
            yield wrong(other, f"must be left out if {BLOCK}.{one} is given")
    if "flow_rate" not in given and "velocity" not in given:
        yield missing(f"{BLOCK}.flow_rate", f"must be given, or else {BLOCK}.velocity")
    law = viscosity_law(case)
    measured = law.measured
    if unknown := [name for name in measured.of_unit if not is_finite(liquid_block(case).get(name))]:
        yield from (missing(f"liquid.{name}", "must be a number, with liquid: {law: ...}") for name in unknown)
        return
    if measured.key not in given:
        yield missing(f"{BLOCK}.{measured.key}", f"must be given in {BLOCK}")
        return
    try:
        eta = si(given[measured.key], known_unit(measured, law.numbers))
    except ValueError as error:
        yield wrong(measured.key, str(error))
        return
    yield from _check_laws(given, measured, stands_for(case))
    if measured is ZERO_SHEAR and "solvent" in given and si(given["solvent"], ZERO_SHEAR) > eta:
        yield wrong("solvent", f"must be at most {BLOCK}.{measured.key} = {given[measured.key]}, which includes it")


def _check_laws(given: Mapping[str, Any], measured: Dimension, keys: list[tuple[str, Dimension]]) -> Iterator[Mistake]:
    """Find quantities that stand for no parameter of the laws, or for several."""
    for key in (key for key in DIMENSIONS if key in given and key != measured.key):
        of = [place for place, dimension in keys if dimension.key == key]
        if not of:
            allowed = f"must be left out: the laws of this case need no {key} ({DIMENSIONS[key].words})"
            yield Mistake(f"{BLOCK}.{key}", given[key], allowed)
        elif len(in_liquid := [place for place in of if place.startswith("liquid.")]) > 1:
            allowed = f"must be left out: it would stand for {' and '.join(in_liquid)}, which are to be given"
            yield Mistake(f"{BLOCK}.{key}", given[key], allowed)


class Translation:
    """The keys and values of a case with the numbers of its `physical` block filled in.

    Args:
        data: The case as given, with lists as tuples.
        fields: Keys that this kind of case has.

    Attributes:
        data: The case with the numbers; unchanged if there is no `physical` block or it has mistakes.
        mistakes: Inconsistent keys of the block, and keys of the case that contradict it.
        given: Keys of the case that the block has quantities for.
    """

    def __init__(self, data: Mapping[str, Any], fields: Mapping[str, Any]) -> None:
        self.data, self.mistakes, self.given = dict(data), list[Mistake](), set[str]()
        self._origins: dict[str, str] = {}
        self._instead: dict[str, str] = {}
        self._physical = read_block(data)
        if self._physical is None:
            return
        for key, dimension in reversed(stands_for(data)):  # modulus rather than young
            self._instead[_own(key, fields)] = dimension.key
        self.given = {key for key, origin in self._instead.items() if origin in self._physical.given}
        self.mistakes += check_physical(self._physical, data)
        if self.mistakes:
            return
        self.data = copy.deepcopy(self.data)
        if isinstance(solid := self.data.get("solid"), tuple):
            self.data["solid"] = tuple({"law": each} if isinstance(each, str) else each for each in solid)
        for key, (origin, number) in self._physical.numbers(data).items():
            self._fill(_own(key, fields), f"{BLOCK}.{origin}", number, fields)
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
            self._origins[key] = origin

    def at_origin(self, mistake: Mistake) -> Mistake:
        """Turn a mistake in a number that was filled in into one of the key of the block that it was computed from."""
        if mistake.is_missing and mistake.key in self._instead:
            return Mistake(mistake.key, None, f"{mistake.allowed}, or be given by {BLOCK}.{self._instead[mistake.key]}")
        origin = self._origins.get(mistake.key) or self._origins.get(mistake.key.partition("[")[0])
        if origin is None or mistake.value is None or self._physical is None:
            return mistake
        given = self._physical.given[origin.removeprefix(f"{BLOCK}.")]
        sizes = mistake.value if isinstance(mistake.value, list | tuple) else [mistake.value]
        if mistake.key.startswith("beta") and all(is_finite(each) for each in sizes) and max(sizes) >= 1:
            return Mistake(origin, given, f"must be smaller than the tube of {self._physical.given['tube']}")
        return Mistake(origin, given, f"gives {mistake.key} = {shown(mistake.value)}, which {mistake.allowed}")


def _own(key: str, fields: Mapping[str, Any]) -> str:
    """The key of this kind of case: `d0` for `d` where it has that."""
    return "d0" if key == "d" and "d0" in fields else key


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
        if isinstance(inner, list | tuple):
            inner = inner[int(group)]
            continue
        if not isinstance(inner, dict):
            return None, name
        if isinstance(inner.get(group), str):
            inner[group] = {"law": inner[group]}
        inner = inner.setdefault(group, {})
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

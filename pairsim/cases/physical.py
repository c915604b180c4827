"""The `physical` block of a case: quantities of an experiment, which become numbers before the case is validated.

De = lambda U_av/D_c and Ca_e = eta_0 U_av/(D_c G_p) with U_av = 4 Q/(pi D_c^2), as in Esposito, D'Avino and Villone
(2024).
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError, WithJsonSchema, create_model

from pairsim.cases.materials import declared_in, liquid_block
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.quantities import LENGTH, a_length, known_unit, measured, percentage, quantity_range, rounded
from pairsim.cases.usual import unusual
from pairsim.cases.values import Range, is_finite
from pairsim.cases.yaml_file import within
from pairsim.physics import liquids
from pairsim.physics.declared import DIMENSIONS
from pairsim.physics.liquids import Liquid, Newtonian, ViscousLaw
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.material import Dimension, a_time
from pairsim.physics.solids.solid import MODULUS
from pairsim.quantities.scales import Scales, mean_velocity

BLOCK = "physical"
SAME = 1e-9  # relative tolerance at which two numbers count as equal
RANGE_OF_LENGTHS = "{start: 5 um, stop: 40 um, num: 9}"


class Quantity(NamedTuple):
    """A key of the block."""

    dimension: Dimension  # has the name of the key
    gives: str = ""  # dotted key of the case that it stands for (`d` for `d` and `d0`), "" if there is none
    many: bool = False  # whether it takes one value for each particle
    uncertain: bool = False  # whether it may have a half-width, as there are derivatives of dU by it

    @property
    def key(self) -> str:
        return self.dimension.key

    @property
    def field(self) -> Any:
        """Type and description of the field; `in_si` checks its values."""
        one = {"type": "string", "examples": [self.dimension.example]}
        several: list[Any] = [{"type": "array", "items": one}] if self.many or self.gives == "d" else []
        several += [{"type": "object", "examples": [RANGE_OF_LENGTHS]}] if self.gives == "d" else []
        kind = Annotated[Any, WithJsonSchema({"anyOf": [one, *several]} if several else one)]
        return kind, Field(... if self.key == "tube" else None, description=self.dimension.words)

    def in_si(self, value: Any, place: str, of: Dimension, mistakes: list[Mistake]) -> Any:
        """A value in SI units, or a tuple of the values of a list or range; mistakes are added to a list."""
        ranged = self.gives == "d"
        entries = value
        try:
            if isinstance(value, Mapping) and ranged:
                entries = quantity_range(Range[str].model_validate(value))
            if not isinstance(entries, list | tuple) or not (self.many or ranged):
                number, half_width = measured(value, of)
                if half_width and not self.uncertain:
                    raise ValueError("must be given without +-")
                return number
        except ValueError as error:
            of_range = error.errors() if isinstance(error, ValidationError) else ()
            unfit = ", ".join(str(each["loc"][0]) for each in of_range)
            wrong = f"has no valid {unfit}" if unfit else str(error)
            also = f"; may be a list or a range, too, such as {RANGE_OF_LENGTHS}" if ranged else ""
            mistakes.append(Mistake(place, value, wrong + also))
            return None
        one = self._replace(uncertain=False)
        return tuple(one.in_si(each, f"{place}[{i}]", of, mistakes) for i, each in enumerate(entries))


class Difference(Quantity):
    """A key with a percentage, of either sign and with or without a half-width: 0 +- 1 %."""

    def in_si(self, value: Any, place: str, of: Dimension, mistakes: list[Mistake]) -> Any:
        """The part, .01 for 1 %; mistakes are added to a list."""
        try:
            return percentage(value)[0]
        except ValueError as error:
            mistakes.append(Mistake(place, value, str(error)))
            return None


def _measured(key: str, kind: str, words: str, unit: str, example: str, symbol: str) -> Quantity:
    """A quantity that sets a scale, and is no number of the case."""
    dimension = Dimension(key, kind, words, unit, example, lambda value, _: value, symbol)
    return Quantity(dimension, uncertain=key != "density")


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
    "distance", "distance between the facing surfaces; gives d0 of a run, d of curve, critical and train", "5 um", "d_0"
)
SPACING = a_length("spacing", "distance between the centres of neighbours; gives train.spacing", "30 um", "s")
CAPILLARY = a_length("capillary", "length of tube along which a row is followed; gives row.tube", "40 cm", "L")
CONTACT = a_length("contact", "distance at which beads of a row touch; gives row.min_gap", "100 nm", r"d_\mathrm{min}")
FLOW_RATE = "flow rate Q; gives the mean velocity U_av = 4 Q/(pi D_c^2)"
VELOCITY = "mean velocity of the liquid U_av, in place of flow_rate"
DENSITY = _measured(
    "density", "a density", "density of the liquid, only used for the Reynolds number", "kg/m^3", "1000 kg/m^3", r"\rho"
)
DIFFERENCE = Dimension(
    "particle_difference",
    "a percentage",
    "difference of the diameters of two particles, leading less trailing over their mean, which is `particle`",
    "%",
    "0 +- 1 %",
    lambda value, _: value,
    r"\delta",
)
EXPERIMENT = (
    Quantity(a_length("tube", "inner diameter of the tube D_c", symbol="D_c"), uncertain=True),
    _measured("flow_rate", "a flow rate", FLOW_RATE, "m^3/s", "1 ul/min", "Q"),
    _measured("velocity", "a velocity", VELOCITY, "m/s", "5 mm/s", "U_{av}"),
    Quantity(a_length("particle", "diameter D_p; gives beta = D_p/D_c", "20 um", "D_p"), "beta", True, True),
    Difference(DIFFERENCE, uncertain=True),
    Quantity(MODULUS, "Ca_e", True, True),
    Quantity(YOUNG, "Ca_e", True, True),
    DENSITY,
    Quantity(DISTANCE, "d"),
    Quantity(SPACING, "train.spacing"),
    Quantity(CAPILLARY, "row.tube"),
    Quantity(CONTACT, "row.min_gap"),
    Quantity(a_time("end", "end time of a run; gives time.end"), "time.end"),
)
UNCERTAIN = "viscosity", "relaxation", "solvent"  # of liquids
OF_MATERIALS = (Quantity(each, uncertain=each.key in UNCERTAIN) for each in DIMENSIONS.values())
QUANTITIES = {each.key: each for each in (*EXPERIMENT, *OF_MATERIALS)}
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

    def scales(self, case: Mapping[str, Any]) -> Scales:
        """The units of length, velocity and stress in SI units, in a valid case."""
        return _scales(values_in(dict(self), case, []), viscosity_law(case))


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


def given_by(case: Mapping[str, Any], fields: Collection[str]) -> list[str]:
    """Those of some dotted keys that quantities of the block of a case stand for."""
    block = case.get(BLOCK)
    given = [name for name, of in stands_for(case) if isinstance(block, Mapping) and block.get(of.key) is not None]
    return [key for name in given if (key := _key_in(name, fields)) in fields]


def _key_in(name: str, fields: Collection[str]) -> str:
    """What a key that the block stands for is called among some keys: distances of a run are d0."""
    return "d0" if name == "d" and "d0" in fields else name


def values_in(block: Mapping[str, Any], case: Mapping[str, Any], mistakes: list[Mistake]) -> dict[str, Any]:
    """The quantities of a block in SI units, by key; mistakes are added to a list."""
    liquid, measured = liquid_block(case), viscosity_law(case).measured
    numbers = {name: liquid[name] for name in measured.of_unit if is_finite(liquid.get(name))}
    found = {}
    for key, value in block.items():
        if key in QUANTITIES and value is not None:
            dimension = known_unit(QUANTITIES[key].dimension, numbers if key == measured.key else {})
            found[key] = QUANTITIES[key].in_si(value, f"{BLOCK}.{key}", dimension, mistakes)
    return found


def far_from_usual(block: Mapping[str, Any], case: Mapping[str, Any]) -> list[str]:
    """Sentences on quantities of a block that are far from usual, as if the prefix of a unit was misread."""
    units = {key: each.dimension.unit.replace("*", ".") for key, each in QUANTITIES.items()}
    return [*unusual(block, values_in(block, case, []), units)]


def _scales(values: Mapping[str, Any], law: ViscousLaw) -> Scales:
    """The scales from quantities in SI units."""
    length = values["tube"]
    velocity = values["velocity"] if "velocity" in values else mean_velocity(values["flow_rate"], length)
    return Scales(length, velocity, law.unit_viscosity(values[law.measured.key], velocity / length))


def _check_together(values: Mapping[str, Any], block: Mapping[str, Any], case: Mapping[str, Any]) -> Iterator[Mistake]:
    """Check quantities in SI units against each other and against the laws of the case; yields mistakes."""

    def wrong(key: str, allowed: str) -> Mistake:
        return Mistake(f"{BLOCK}.{key}", block[key], allowed)

    for one, other in (("flow_rate", "velocity"), ("modulus", "young")):
        if one in values and other in values:
            yield wrong(other, f"must be left out if {BLOCK}.{one} is given")
    if "flow_rate" not in values and "velocity" not in values:
        yield missing(f"{BLOCK}.flow_rate", f"must be given, or else {BLOCK}.velocity")
    if DIFFERENCE.key in values:
        if not isinstance(values.get("particle"), float):
            yield wrong(DIFFERENCE.key, f"must go with {BLOCK}.particle, one diameter: the mean of both")
        if case.get("particles", 2) != 2:
            yield wrong(DIFFERENCE.key, "must be left out: it is that of two particles")
    measured = viscosity_law(case).measured
    if unknown := [name for name in measured.of_unit if not is_finite(liquid_block(case).get(name))]:
        yield from (missing(f"liquid.{name}", "must be a number, with liquid: {law: ...}") for name in unknown)
        return
    if measured.key not in values:
        yield missing(f"{BLOCK}.{measured.key}", f"must be given in {BLOCK}")
        return
    keys = stands_for(case)
    for key in (key for key in DIMENSIONS if key in values and key != measured.key):
        of = [place for place, dimension in keys if dimension.key == key]
        in_liquid = [place for place in of if place.startswith("liquid.")]
        if not of:
            yield wrong(key, f"must be left out: the laws of this case need no {key} ({DIMENSIONS[key].words})")
        elif len(in_liquid) > 1:
            yield wrong(key, f"must be left out: it would stand for {' and '.join(in_liquid)}, which are to be given")
    if measured is ZERO_SHEAR and values.get("solvent", 0) > values[measured.key]:
        yield wrong("solvent", f"must be at most {BLOCK}.{measured.key} = {block[measured.key]}, which includes it")


def numbers_of(case: Mapping[str, Any], mistakes: list[Mistake]) -> dict[str, Any]:
    """The dimensionless numbers that follow from the `physical` block of a case, by dotted key (`d` for `d` and `d0`).

    Other keys need not be validated yet. There are no numbers without a block, or if it has mistakes, which are added.
    """
    block = case.get(BLOCK)
    if not isinstance(block, Mapping):
        return {}
    values = values_in(block, case, mistakes)
    if not mistakes:
        mistakes += _check_together(values, block, case)
    if mistakes or "tube" not in values:
        return {}
    return {key: _each(number, rounded) for key, number in numbers_from(values, case)[1].items()}


def numbers_from(values: Mapping[str, Any], case: Mapping[str, Any]) -> tuple[Scales, dict[str, Any]]:
    """The scales and the numbers of a case from its quantities in SI units, which may be arrays; see `numbers_of`."""
    scales, found = _scales(values, viscosity_law(case)), dict[str, Any]()
    for key, of in stands_for(case):
        if of.key in values:
            # A solvent is in units of its own viscosity.
            of_solvent = key.startswith("liquid.solvent.") and "xi" in found
            own = replace(scales, viscosity=found["xi"] * scales.viscosity) if of_solvent else scales
            found[key] = _each(values[of.key], of.number, own)
    if "beta" in found and values.get(DIFFERENCE.key):
        found["beta"] = tuple(found["beta"] * (1 + side * values[DIFFERENCE.key] / 2) for side in (-1, 1))
    return scales, found


def _each(value: Any, function: Callable[..., Any], *more: Any) -> Any:
    """A function of a value and of `more`, or of each of the values in nested tuples."""
    return tuple(_each(each, function, *more) for each in value) if isinstance(value, tuple) else function(value, *more)


class InNumbers(NamedTuple):
    """A case whose quantities have become numbers, and the mistakes of its `physical` block.

    The origin of each dotted key is that of the quantity which is given in its place, right or wrong.
    """

    data: dict[str, Any]
    origins: dict[str, str]
    mistakes: list[Mistake]

    def named(self, mistake: Mistake) -> Mistake:
        """A mistake in a number as one of the quantity that it follows from."""
        origin = self.origins.get(mistake.key) or self.origins.get(mistake.key.partition("[")[0])
        if origin is None or mistake.value is None:
            return mistake
        block = self.data[BLOCK]
        where = f"in a tube of {block['tube']} " if QUANTITIES[origin].dimension.unit == LENGTH.unit else ""
        number = f"{where}that is {mistake.key} = {_shown(mistake.value)}"
        remarks = [f"; {each}" for each in far_from_usual(block, self.data)]
        return Mistake(f"{BLOCK}.{origin}", block[origin], f"{number}; {mistake.allowed}{''.join(remarks)}")


def in_numbers(given: Mapping[str, Any], fields: Collection[str]) -> InNumbers:
    """Put numbers that follow from the `physical` block of a case beside it, for keys that it may have (`fields`)."""
    data, origins, mistakes = copy.deepcopy(dict(given)), dict[str, str](), list[Mistake]()
    numbers = numbers_of(given, mistakes)
    if not isinstance(block := given.get(BLOCK), Mapping):
        return InNumbers(data, origins, mistakes)
    for name, of in stands_for(given):
        if block.get(of.key) is None:
            continue
        key = _key_in(name, fields)
        if re.split(r"[.\[]", key)[0] not in fields:
            mistakes.append(Mistake(f"{BLOCK}.{of.key}", None, f"must be left out: this kind of case has no {key}"))
            continue
        try:
            group, last = within(data, key)
        except ValueError:
            continue  # rejected by the validation
        if (own := group.get(last)) is None:
            group[last] = numbers.get(name)
            origins[key] = of.key
        elif name in numbers and not _same(own, numbers[name]):
            allowed = f"must be left out, or be {_shown(numbers[name])} as given by {BLOCK}.{of.key}"
            mistakes.append(Mistake(key, own, allowed))
    return InNumbers(data, origins, mistakes)


def forget_numbers(data: dict[str, Any]) -> None:
    """Remove from a case, as read from a folder of results, the numbers computed from its `physical` block.

    They would contradict the block after a change of it. Numbers that differ from those of the block are kept, so that
    the contradiction is reported.
    """
    numbers = numbers_of(data, [])
    for key, number in numbers.items():
        for name in ("d", "d0") if key == "d" else (key,):
            with suppress(ValueError):  # there is another value in place of its group
                group, last = within(data, name) if re.split(r"[.\[]", name)[0] in data else ({}, name)
                if last in group and _same(group[last], number):
                    del group[last]
    if numbers and "De" not in numbers and data.get("De") == 0:
        del data["De"]


def _same(given: Any, number: Any) -> bool:
    """Whether two numbers, or two lists of numbers, are equal within the relative tolerance `SAME`."""
    if isinstance(given, list | tuple) or isinstance(number, tuple):
        many = [value if isinstance(value, list | tuple) else (value,) for value in (given, number)]
        return len(many[0]) == len(many[1]) and all(_same(a, b) for a, b in zip(*many, strict=True))
    return is_finite(given) and math.isclose(given, number, rel_tol=SAME)


def _shown(number: Any) -> str:
    """A number or a list of numbers as text for a message."""
    if isinstance(number, tuple | list):
        return f"[{', '.join(map(_shown, number))}]"
    return f"{number:.4g}" if is_finite(number) else str(number)

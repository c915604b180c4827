"""The quantities of a `physical` block with the laws of its case: values, scales, and the numbers that follow."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple, Self, cast

from pydantic import ValidationError

from pairsim.cases.laws import Laws
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.physical import (
    BLOCK,
    DENSITY,
    DEVIATIONS,
    DIFFERENCE,
    EXPERIMENT,
    QUANTITIES,
    RANGE_OF_LENGTHS,
    TUBE,
    with_deviations,
)
from pairsim.cases.quantity_text import is_in, measured, quantity_range, rounded
from pairsim.cases.usual import unusual
from pairsim.cases.values import Range
from pairsim.cases.waveform_keys import WaveformOptions
from pairsim.cases.yaml_file import Content
from pairsim.physics.declared import DIMENSIONS
from pairsim.physics.liquids import Liquid
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.quantities.measurable import EACH, MEAN, Measurable
from pairsim.quantities.scales import Scales, cross_section, mean_velocity

if TYPE_CHECKING:
    from pairsim.runtime.arrays import Array

USUAL_COUNT = 2  # particles, if neither the case nor its question says otherwise

type Amount = float | Array | tuple[Amount, ...]
"""A quantity in SI units, or a dimensionless number: a value, an array of draws, or a tuple for particles or gaps."""
type Amounts = Mapping[str, Amount]
"""Quantities by their keys in the `physical` block, or numbers by their dotted keys."""


class Follows(NamedTuple):
    """A number of a case, and the quantity from which it follows if that is given."""

    keys: tuple[str, ...]  # its dotted key, and the keys that it has in other kinds of cases
    quantity: Measurable

    @property
    def key(self) -> str:
        return self.keys[0]

    def key_in(self, fields: Collection[str]) -> str:
        """The key that it has among `fields`: the distance of a run, for instance, is d0."""
        return next((key for key in reversed(self.keys) if key in fields or group_of(key) in fields), self.key)


def group_of(key: str) -> str:
    """The top-level key of a case to which a dotted key belongs."""
    return re.split(r"[.\[]", key)[0]


def follows_in(laws: Laws) -> list[Follows]:
    """The numbers that follow from quantities in a case with these laws."""
    of_laws = [((key,), each.dimension) for key, each in Liquid.OF_POLYMER.items()]
    of_laws += [((each.key,), each.parameter.dimension) for each in laws.declared()]
    own = [Follows(each.gives, each) for each in QUANTITIES.values() if each.gives]
    return own + [Follows(keys, quantity) for keys, quantity in of_laws if quantity is not None]


@dataclass(frozen=True)
class Experiment:
    """The quantities that an experiment has measured, and the laws of its case, which need not be valid yet.

    Attributes:
        given: The quantities by key, as they are written; standard deviations among particles have their own keys.
        laws: The laws of the case, to whose parameters some quantities belong.
        particles: The number of particles, as it is given.
        waveform: A flow that varies, whose mean |Q| gives U_av if neither `flow_rate` nor `velocity` is given.
    """

    given: Content
    laws: Laws
    particles: Any = USUAL_COUNT
    waveform: WaveformOptions | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "given", with_deviations(self.given))

    @classmethod
    def in_case(cls, case: Content, particles: int = USUAL_COUNT) -> Self | None:
        """The experiment of a case as keys and values, validated or not; None without a `physical` block.

        Args:
            case: The case.
            particles: The number of particles in a case that does not give it.
        """
        block = case.get(BLOCK)
        if not isinstance(block, Mapping):
            return None
        given = {key: value for key, value in block.items() if value is not None}
        return cls(given, Laws.in_case(case), case.get("particles", particles), WaveformOptions.in_case(case))

    @cached_property
    def _in_si(self) -> tuple[dict[str, Amount], list[Mistake]]:
        """The quantities in SI units, with None in place of invalid ones, and the mistakes in these."""
        law = self.laws.liquid.viscosity_law.measured
        values, mistakes = dict[str, Amount](), list[Mistake]()
        for key, text in self.given.items():
            if (of := QUANTITIES.get(key)) is not None:
                if key in DEVIATIONS:
                    values[key] = self._part_of_mean(key, values.get(key.partition(".")[0]), mistakes)
                    continue
                of = of.with_parameters(self.laws.liquid.numbers(law.of_unit) if key == law.key else {})
                values[key] = _in_si(of.volume if self._is_volume(key) else of, text, f"{BLOCK}.{key}", mistakes)
        for key in filter(self._is_volume, values):
            values[key] = _length_of_tube(values[key], values.get(TUBE.key))
        return values, mistakes

    def _is_volume(self, key: str) -> bool:
        """Whether a quantity that is a length of tube is given as the volume that this length holds."""
        of = QUANTITIES[key]
        return bool(of.as_volume) and is_in(self.given[key], of.volume.unit)

    def _part_of_mean(self, key: str, mean: Any, mistakes: list[Mistake]) -> Any:
        """A standard deviation among the particles over the mean [SI units]; None, and a mistake added, if invalid."""
        of, text = replace(QUANTITIES[key.partition(".")[0]], uncertain=False), self.given[key]
        if isinstance(mean, tuple):
            mistakes.append(Mistake(f"{BLOCK}.{key}", text, f"must go with a single {MEAN}, not with a list"))
        elif (deviation := _in_si(replace(of, many=False), text, f"{BLOCK}.{key}", mistakes)) is not None and mean:
            return float(deviation / mean)
        return None

    @property
    def values(self) -> dict[str, Amount]:
        """The quantities in SI units, with tuples of those that have several values."""
        return dict(self._in_si[0])

    @property
    def mistakes(self) -> list[Mistake]:
        """The mistakes in single quantities, or, if there are none, those between quantities."""
        return self._in_si[1] or list(self._check_together())

    @property
    def mean_flow(self) -> float | None:
        """The mean |Q| of a flow that varies [m^3/s]; None if there is none that has units."""
        return self.waveform.mean_size if self.waveform is not None else None

    @property
    def scales(self) -> Scales:
        """The units of length, velocity and viscosity in SI units; the experiment must be valid."""
        return self._scales(self.values)

    def reynolds_number(self, scales: Scales) -> float | None:
        """The Reynolds number rho U_av D_c/eta_0 by these scales; None if the density is not known."""
        density = self.values.get(DENSITY.key)
        return float(scales.reynolds(density)) if isinstance(density, float) else None

    @property
    def numbers(self) -> dict[str, Amount]:
        """The dimensionless numbers that follow, by the first of their keys; empty if there are mistakes."""
        if self.mistakes or "tube" not in self.values:
            return {}
        return {key: _each(number, rounded) for key, number in self.with_values(self.values)[1].items()}

    @property
    def remarks(self) -> list[str]:
        """Sentences on quantities far outside the usual range, as when the prefix of a unit was mistaken."""
        values = self.values
        return [remark for key, value in values.items() for remark in unusual(QUANTITIES[key], self.given[key], value)]

    def with_values(self, values: Amounts) -> tuple[Scales, dict[str, Amount]]:
        """The scales and the dimensionless numbers with other values of the quantities [SI units], perhaps arrays."""
        scales, found = self._scales(values), dict[str, Amount]()
        for each in follows_in(self.laws):
            if each.quantity.key in values:
                # A solvent is in units of its own viscosity.
                of_solvent = each.key.startswith("liquid.solvent.") and "xi" in found
                own = replace(scales, viscosity=one(found, "xi") * scales.viscosity) if of_solvent else scales
                found[each.key] = _each(values[each.quantity.key], each.quantity.number, own)
        if "beta" in found and values.get(DIFFERENCE.key):
            beta, difference = one(found, "beta"), one(values, DIFFERENCE.key)
            found["beta"] = tuple(beta * (1 + side * difference / 2) for side in (-1, 1))
        return scales, found

    def _scales(self, values: Amounts) -> Scales:
        """The scales from quantities in SI units."""
        length, law = one(values, "tube"), self.laws.liquid.viscosity_law
        if "velocity" in values:
            velocity = one(values, "velocity")
        else:
            flow = self.mean_flow if "flow_rate" not in values else None
            velocity = mean_velocity(flow if flow is not None else one(values, "flow_rate"), length)
        return Scales(length, velocity, law.unit_viscosity(one(values, law.measured.key), velocity / length))

    def _check_together(self) -> Iterator[Mistake]:
        """Check quantities in SI units against each other and against the laws; yields mistakes."""
        values = self.values

        def wrong(key: str, allowed: str) -> Mistake:
            return Mistake(f"{BLOCK}.{key}", self.given[key], allowed)

        if TUBE.key not in values:
            yield missing(f"{BLOCK}.{TUBE.key}", f"must be given, such as {TUBE.example}")
        given = [each for each in follows_in(self.laws) if each.quantity.key in values]
        rivals = [
            (one.quantity.key, other.quantity.key) for one, other in combinations(given, 2) if one.key == other.key
        ]
        for one, other in [("flow_rate", "velocity"), *rivals]:
            if one in values and other in values:
                yield wrong(other, f"must be left out if {BLOCK}.{one} is given")
        if "flow_rate" not in values and "velocity" not in values and self.mean_flow is None:
            of_waveform = list(self.waveform.mistakes(scaled=True)) if self.waveform is not None else []
            yield from of_waveform
            if not of_waveform:
                yield missing(f"{BLOCK}.flow_rate", f"must be given, or {BLOCK}.velocity instead")
        if DIFFERENCE.key in values:
            if not isinstance(values.get("particle"), float):
                yield wrong(DIFFERENCE.key, f"must go with a single diameter {BLOCK}.particle, the mean of both")
            if self.particles != 2:
                yield wrong(DIFFERENCE.key, "must be left out: it applies to two particles only")
        yield from self._check_laws(values, wrong)

    def _check_laws(self, values: Amounts, wrong: Callable[[str, str], Mistake]) -> Iterator[Mistake]:
        """Check whether the quantities are those that the laws need; yields mistakes."""
        law = self.laws.liquid.viscosity_law.measured
        if unknown := [name for name in law.of_unit if name not in self.laws.liquid.numbers(law.of_unit)]:
            yield from (missing(f"liquid.{name}", "must be a number, with liquid: {law: ...}") for name in unknown)
            return
        if law.key not in values:
            yield missing(f"{BLOCK}.{law.key}", f"must be given in {BLOCK}")
            return
        follows = follows_in(self.laws)
        for key in (key for key in DIMENSIONS if key in values and key != law.key):
            of = [each.key for each in follows if each.quantity.key == key]
            in_liquid = [place for place in of if place.startswith("liquid.")]
            apart_from_mode = {re.sub(r"\[\d+\]", "", place) for place in in_liquid}
            if not of:
                yield wrong(key, f"must be left out: the laws of this case have no {key} ({DIMENSIONS[key].words})")
            elif len(apart_from_mode) > 1:
                places = " and ".join(in_liquid)
                yield wrong(key, f"must be left out: it could be any of {places}, which must be given instead")
        if law is ZERO_SHEAR and "solvent" in values and one(values, "solvent") > one(values, law.key):
            yield wrong("solvent", f"must be at most {BLOCK}.{law.key} = {self.given[law.key]}, which includes it")


def one(values: Amounts, key: str) -> float:
    """The value of a quantity or number that a case has once; of draws it is an array, used like a float."""
    return cast("float", values[key])


def changes_no_other(key: str) -> bool:
    """Whether a quantity, such as a distance or a time, determines a key of its own and no other number."""
    return QUANTITIES[key] in EXPERIMENT and not QUANTITIES[key].uncertain


def _in_si(of: Measurable, value: Any, place: str, mistakes: list[Mistake]) -> Any:
    """A value in SI units, or a tuple of those of a list or range; None, and a mistake added, if it is invalid."""
    entries = value
    try:
        if isinstance(value, Mapping) and of.ranged:
            entries = quantity_range(Range[str].model_validate(value))
        if not isinstance(entries, list | tuple) or not (of.many or of.ranged):
            number, half_width = measured(value, of)
            if half_width and not of.uncertain:
                raise ValueError("must be given without +-")
            return number
    except ValueError as error:
        of_range = error.errors() if isinstance(error, ValidationError) else ()
        unfit = ", ".join(str(each["loc"][0]) for each in of_range)
        wrong = f"has no valid {unfit}" if unfit else str(error)
        also = f"; may also be a list, or a range such as {RANGE_OF_LENGTHS}" if of.ranged else ""
        if of.each and isinstance(value, Mapping):
            also = f", or, if particles differ, {{{MEAN}: {of.example}, {EACH}: ...}} with their standard deviation"
        mistakes.append(Mistake(place, value, wrong + also))
        return None
    one = replace(of, uncertain=False)
    return tuple(_in_si(one, each, f"{place}[{i}]", mistakes) for i, each in enumerate(entries))


def _length_of_tube(volume: Any, diameter: Any) -> Any:
    """The length [m] of a tube of a given diameter [m] that holds a volume [m^3]; None if either is None."""
    if volume is None or diameter is None:
        return None
    return rounded(volume / cross_section(diameter))


def _each(value: Any, function: Callable[..., Any], *more: Any) -> Any:
    """Apply a function to a value and `more`, or to each value in nested tuples."""
    return tuple(_each(each, function, *more) for each in value) if isinstance(value, tuple) else function(value, *more)

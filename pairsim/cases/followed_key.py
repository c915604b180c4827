"""A number or a quantity of a case over which solutions are followed, and the liquid and particles at its values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self

from pairsim.cases.case import SceneCase
from pairsim.cases.experiment import Amount, Experiment
from pairsim.cases.laws import OF_ALL
from pairsim.cases.physical import BLOCK, QUANTITIES
from pairsim.cases.quantity_text import in_one_unit, si
from pairsim.cases.values import is_finite
from pairsim.physics.liquids import Liquid
from pairsim.physics.material import Parameter
from pairsim.physics.solids import Solid
from pairsim.quantities.measurable import Measurable
from pairsim.quantities.scales import Scales

DIFFER = 1e-12  # relative difference of numbers up to which it is due to rounding; chosen

type Materials = tuple[Liquid, tuple[Solid | None, ...]]


@dataclass(frozen=True)
class FollowedKey:
    """A key over which solutions of a case are followed; only the liquid and the solids may depend on it.

    Attributes:
        case: The case.
        key: The dotted key, such as De, liquid.alpha or physical.flow_rate.
        values: The values at which solutions are requested, ascending, in `unit`.
        unit: The unit of a quantity, as it is given; "" for a number.
        in_si: This unit in SI units.
    """

    case: SceneCase
    key: str
    values: tuple[float, ...]
    unit: str = ""
    in_si: float = 1.0

    @classmethod
    def of(cls, case: SceneCase, key: str, given: Sequence[float | str]) -> Self:
        """The followed key of a valid case with the values that are given.

        Raises:
            ValueError: The case has no such number or quantity, it cannot be followed, or a value is not allowed; says
                what is allowed.
        """
        quantity = key.removeprefix(f"{BLOCK}.") if key.startswith(f"{BLOCK}.") else ""
        if not quantity:
            cls(case, key, ())._check_number()
            if not all(map(is_finite, given)):
                raise ValueError(f"must be numbers, since {key} is one")
            found = cls(case, key, tuple(sorted(map(float, given))))
        else:
            if case.experiment is None or quantity not in case.experiment.given:
                raise ValueError(f"must be a quantity in {BLOCK} of the case, whose value along then replaces")
            if not all(isinstance(each, str) for each in given):
                raise ValueError(f"must be quantities with their unit, such as {QUANTITIES[quantity].example}")
            texts, of = [str(each) for each in given], _quantity(case, quantity)
            known = [si(each, of) for each in texts]
            values, unit = in_one_unit(texts)
            found = cls(case, key, tuple(sorted(values)), unit, known[0] / values[0])
        found._check_ends()
        return found

    def value_of(self, text: str) -> float:
        """Convert a text with a unit into a value of the quantity, in the unit of `values`.

        Raises:
            ValueError: The text has no such unit, or what is followed is a number without a unit.
        """
        if not self.unit:
            raise ValueError(f"must be a number, since {self.key} is one")
        return float(si(text, _quantity(self.case, self.key.removeprefix(f"{BLOCK}."))) / self.in_si)

    @property
    def _parameters(self) -> dict[str, Parameter]:
        """The parameters of the liquid and the solids of the case, by their dotted keys."""
        liquid = self.case.liquid_model
        shared = {name: each for name, each in OF_ALL.items() if name == "Ca_e" or liquid.modes}
        return shared | {each.key: each.parameter for each in self.case.declared_parameters}

    def _check_number(self) -> None:
        known = self._parameters
        if self.key not in known:
            quantities = [f"{BLOCK}.{each}" for each in (self.case.experiment.given if self.case.experiment else ())]
            allowed = ", ".join((*known, *quantities))
            raise ValueError(f"must be a number of the liquid or of the particles, or a quantity: {allowed}")

    def _check_ends(self) -> None:
        """Check the liquid and the particles that follow at the least and the largest value; ValueError if invalid."""
        if self.values[0] <= 0:
            raise ValueError("must be values above 0")
        least_and_largest = self.values[0], self.values[-1]
        known, ends = self._parameters, [self.numbers(value) for value in least_and_largest]
        if "Ca_e" in ends[0] and len({Ca_e for Ca_e in self.case.Ca_es if Ca_e}) != 1:
            raise ValueError("must go with a single Ca_e above 0, whose value it replaces")
        own = self._experiment.with_values(self._experiment.values)[1] if self.unit else {}
        others = [self._with_values(value)[1] for value in least_and_largest] if self.unit else []
        for name, value in own.items():
            if name not in known and any(_apart(value, each.get(name, value)) for each in others):
                raise ValueError(f"must change nothing but the liquid and the softness of the particles, not {name}")
        for name, parameter in known.items():
            if wrong := [each[name] for each in ends if name in each and not _allowed(each[name], parameter)]:
                number = f", where {name} = {wrong[0]:.4g}" if name != self.key else ""
                raise ValueError(f"must be values of {name} from {parameter.least:g} to {parameter.most:g}{number}")

    @property
    def _experiment(self) -> Experiment:
        assert self.case.experiment is not None, "checked when it was made"
        return self.case.experiment

    def _with_values(self, value: float) -> tuple[Scales, dict[str, Amount]]:
        """The scales and the numbers of the experiment at a value of the quantity."""
        quantity = self.key.removeprefix(f"{BLOCK}.")
        return self._experiment.with_values(self._experiment.values | {quantity: value * self.in_si})

    def numbers(self, value: float) -> dict[str, float]:
        """The parameters of liquid and particles at a value, by their dotted keys; one value for all particles."""
        if not self.unit:
            return {self.key: value}
        found = self._with_values(value)[1]
        own = {name: each for name, each in found.items() if name in self._parameters}
        ones = {name: max(each) if isinstance(each, tuple) else each for name, each in own.items()}
        return {name: each for name, each in ones.items() if isinstance(each, float)}

    def scales(self, value: float) -> Scales | None:
        """The units of length, velocity and viscosity at a value; None without a `physical` block."""
        return self._with_values(value)[0] if self.unit else self.case.scales

    def materials(self, value: float) -> Materials:
        """The liquid, and the solids of the particles, at a value; rigid particles remain rigid."""
        numbers, case = self.numbers(value), self.case
        laws = case.laws.with_numbers(numbers)
        liquid = laws.liquid.model(numbers.get("De", case.De), numbers.get("xi", case.xi))
        return liquid, laws.solid_models(tuple(Ca_e and numbers.get("Ca_e", Ca_e) for Ca_e in case.Ca_es))


def _quantity(case: SceneCase, key: str) -> Measurable:
    """The declaration of a quantity, whose unit may depend on the law of the liquid."""
    of = QUANTITIES[key]
    return of.with_parameters(case.laws.liquid.numbers(of.of_unit))


def _allowed(value: Any, parameter: Parameter) -> bool:
    return isinstance(value, float) and parameter.least <= value <= parameter.most


def _apart(a: Any, b: Any) -> bool:
    """Whether two numbers, or two tuples of numbers, differ by more than rounding."""
    pairs: Iterable[tuple[Any, Any]] = zip(a, b, strict=True) if isinstance(a, tuple) else [(a, b)]
    return any(_apart(x, y) if isinstance(x, tuple) else abs(x - y) > DIFFER * abs(x) for x, y in pairs)

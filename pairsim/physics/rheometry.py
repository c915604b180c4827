"""Liquids fitted to what a rheometer measures: flow curves, normal stresses, and moduli of small oscillations.

Quantities are in SI units: a liquid is evaluated with U_av/D_c = 1/s, so that De is its relaxation time in s, and eta_0
times what it says is its stress in Pa. Deviations are those of logarithms, which weighs all decades alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import brentq, least_squares
from scipy.stats import t as student

from pairsim.physics.homogeneous import moduli, steady_shear
from pairsim.physics.liquids import LAWS, ConformationLaw, Liquid, Newtonian, ViscousLaw
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.material import Dimension, Material, Parameter
from pairsim.runtime.arrays import Array

CONFIDENCE = 0.95
MOST_MODES = 4
LOGARITHMIC = 100.0  # ratio of the bounds of a parameter from which its logarithm is fitted; chosen
FARTHEST = 1e-3, 1e3  # bounds of relaxation times over the inverse of the slowest and fastest rate; chosen
NOT_DESCRIBED = 3.0  # deviation over the scatter of the data above which no law is said to describe them; chosen
LEAST_SCATTER = 0.005  # of the logarithms: what no rheometer does better than; chosen
SPARSE, OF_SPARSE = 12, 0.05  # points of a curve below which its scatter is at most this, and curvature above; chosen
DOUBTFUL = (
    0.2  # half-width of an interval, of a logarithm or the range, above which derivatives are not relied on; chosen
)
SINGULAR = 1e-6  # derivatives below which data do not determine a number, or a combination of several; chosen


@dataclass(frozen=True)
class Measured:
    """What was measured.

    Attributes:
        rate: Shear rates of the flow curve [1/s], (n,).
        viscosity: Viscosities there [Pa s], (n,).
        N1: First normal stress differences there [Pa], (n,), NaN where not measured; empty if none was.
        frequency: Angular frequencies of the moduli [rad/s], (m,).
        storage: Storage moduli G' there [Pa], (m,).
        loss: Loss moduli G'' there [Pa], (m,).
    """

    rate: Array = field(default_factory=lambda: np.empty(0))
    viscosity: Array = field(default_factory=lambda: np.empty(0))
    N1: Array = field(default_factory=lambda: np.empty(0))
    frequency: Array = field(default_factory=lambda: np.empty(0))
    storage: Array = field(default_factory=lambda: np.empty(0))
    loss: Array = field(default_factory=lambda: np.empty(0))

    @property
    def curves(self) -> list[tuple[str, Array, Array]]:
        """Each quantity with its shear rates or frequencies."""
        all_ = [("viscosity", self.rate, self.viscosity), ("N1", self.rate[: len(self.N1)], self.N1)]
        all_ += [("storage", self.frequency, self.storage), ("loss", self.frequency, self.loss)]
        return [(name, x[y > 0], y[y > 0]) for name, x, y in all_ if (y > 0).any()]

    @property
    def kinds(self) -> set[str]:
        """Which quantities were measured."""
        return {name for name, _, _ in self.curves}

    @property
    def fastest(self) -> float:
        """The largest shear rate or frequency."""
        return float(max(x.max() for _, x, _ in self.curves))


@dataclass(frozen=True)
class Number:
    """A number of a fitted liquid.

    Attributes:
        value: Its value.
        least, most: The interval in which it lies with a probability of 95 %, if the law describes the liquid. Ends
            that the data do not determine are infinite; both are the value of a number that was given.
    """

    value: float
    least: float
    most: float

    @property
    def given(self) -> bool:
        return self.least == self.most


@dataclass(frozen=True)
class Fit:
    """A law fitted to data.

    Attributes:
        law: Its class.
        liquid: The liquid in SI units, see above.
        eta_0: Its unit of viscosity [Pa s], or consistency [Pa s^n].
        values: Its numbers by name: eta_0, De (the longest relaxation time), xi, those of the law, and the times and
            weights of modes.
        deviation: Root mean square of the deviations of logarithms.
        criterion: Bayesian information criterion (Schwarz 1978); the smaller, the better.
    """

    law: type[ViscousLaw | ConformationLaw]
    liquid: Liquid
    eta_0: float
    values: dict[str, float]
    deviation: float
    criterion: float
    _problem: _Problem
    _best: Any

    @cached_property
    def numbers(self) -> dict[str, Number]:
        """Its numbers with their intervals.

        They follow from the derivatives at the best fit where that leaves little doubt, else from fits in which the
        number is held at other values, until the squares are too large for the probability.
        """
        problem, x, jac = self._problem, self._best.x, self._best.jac
        free = len(jac) - len(x)
        quantile = student.ppf((1 + CONFIDENCE) / 2, free)
        variance = max(2 * self._best.cost, len(jac) * 1e-12) / free
        sizes = np.maximum(np.linalg.norm(jac, axis=0), SINGULAR)
        inverse = np.linalg.inv(jac.T @ jac / np.outer(sizes, sizes) + SINGULAR**2 * np.eye(len(x)))
        half = quantile * np.sqrt(variance * np.diagonal(inverse)) / sizes
        cost = self._best.cost + quantile**2 * variance / 2
        found = {name: Number(value, value, value) for name, value in self.values.items()}
        for i, (unknown, h) in enumerate(zip(problem.unknowns, half, strict=True)):
            width = DOUBTFUL if unknown.logarithmic else DOUBTFUL * (unknown.high - unknown.low)
            sure = len(x) == 1 or (h <= width and unknown.low < x[i] - h and x[i] + h < unknown.high)
            steps = -min(h, width), min(h, width)
            ends = [x[i] + step if sure else problem.end(self.values, unknown, step, cost) for step in steps]
            found[unknown.name] = Number(self.values[unknown.name], *map(unknown.number, ends))
        return found

    def of(self, quantity: str, x: Array) -> Array:
        """A quantity of `Measured` as the liquid has it [SI], at shear rates or frequencies."""
        return _quantity(self.liquid, self.eta_0, quantity, x)


def _quantity(liquid: Liquid, eta_0: float, quantity: str, x: Array) -> Array:
    if quantity in ("viscosity", "N1"):
        viscosity, N1 = steady_shear(liquid, x)
        return eta_0 * (viscosity if quantity == "viscosity" else N1)
    storage, loss = moduli(liquid, x)
    return eta_0 * (storage if quantity == "storage" else loss)


def scatter(data: Measured) -> float:
    """What neighbouring points of the curves differ by beside their curvature, root mean square of the logarithms.

    The least of what differences of second, third and fourth order say: curvature between points that are far apart
    counts less in the higher ones.
    """
    found = []
    for order, squares in ((2, 6), (3, 20), (4, 70)):
        each = [np.diff(np.log(y), order) ** 2 / squares for _, _, y in data.curves if len(y) > order + 1]
        if each:
            found.append(float(np.sqrt(np.median(np.concatenate(each)) / 0.455)))
    most = np.inf if max(len(y) for _, _, y in data.curves) >= SPARSE else OF_SPARSE
    return float(np.clip(min(found, default=0.0), LEAST_SCATTER, most))


def fits(data: Measured, laws: Sequence[str] | None = None, given: Mapping[str, float] | None = None) -> list[Fit]:
    """All laws that the data can tell, fitted to them, the best first.

    Args:
        data: What was measured.
        laws: Names of laws to be tried; None for all of the kind that the data or the given numbers show.
        given: Numbers that are known, in SI units by the key of their dimension (viscosity, solvent, relaxation), or
            by name.
    """
    given = given or {}
    elastic = data.kinds & {"N1", "storage"} or given.keys() & {"relaxation", "solvent"}
    kind = ConformationLaw if elastic else ViscousLaw
    tried = [LAWS[name] for name in laws] if laws else [law for law in LAWS.values() if issubclass(law, kind)]
    found = [fit for law in tried if (fit := _of_law(law, data, given))]
    return sorted(found, key=lambda fit: fit.criterion)


def _of_law(law: type[ViscousLaw | ConformationLaw], data: Measured, given: Mapping[str, float]) -> Fit | None:
    """A law fitted to data, by one mode or, where moduli are known, by as many as improve it."""
    least = 0 if issubclass(law, ViscousLaw) else 1
    best = _fitted(law, least, data, given)
    for modes in range(2, MOST_MODES + 1) if least and len(data.frequency) else ():
        better = _fitted(law, modes, data, given)
        if better is None or best is None or better.criterion >= best.criterion:
            break
        best = better
    return best


@dataclass(frozen=True)
class _Unknown:
    """A number to be fitted: bounds and first guess; its logarithm is fitted if the bounds are far apart."""

    name: str
    least: float
    most: float
    guess: float

    @property
    def logarithmic(self) -> bool:
        return self.least > 0 and self.most / self.least > LOGARITHMIC

    @property
    def low(self) -> float:
        return self.fitted(self.least)

    @property
    def high(self) -> float:
        return self.fitted(self.most)

    def fitted(self, value: float) -> float:
        return float(np.log(value)) if self.logarithmic else value

    def number(self, fitted: float) -> float:
        """The number; infinite ends of an interval stay infinite."""
        return float(np.exp(fitted)) if self.logarithmic and np.isfinite(fitted) else float(fitted)


def dimensions_of(law: type[ViscousLaw | ConformationLaw]) -> dict[str, Dimension | None]:
    """The measurable quantity of each number of a liquid of a law, None for those that are pure numbers."""
    measured = law.measured if issubclass(law, ViscousLaw) else ZERO_SHEAR
    of_polymer = {} if issubclass(law, ViscousLaw) else Liquid.OF_POLYMER
    return {"eta_0": measured} | {name: p.dimension for name, p in {**of_polymer, **law.parameters()}.items()}


def _unknowns(law: type[Material], modes: int, data: Measured) -> list[_Unknown]:
    """The numbers of a liquid, with first guesses from the data."""
    rates = np.concatenate([x for _, x, _ in data.curves])
    slow, fast, middle = rates.min(), rates.max(), float(np.exp(np.log(rates).mean()))
    viscosities = data.viscosity if len(data.viscosity) else data.loss / data.frequency
    least, eta = float(viscosities.min()), float(viscosities.max())
    times = FARTHEST[0] / fast, FARTHEST[1] / slow
    # That of a liquid that yields is the viscosity where it flows fast.
    yields = any(p.dimension is not None and p.dimension.unit == "Pa" for p in law.parameters().values())
    found = [_Unknown("eta_0", 1e-3 * least, 1e3 * eta, least if yields else eta)]
    if modes:
        found += [_Unknown("De", *times, 1 / slow if modes > 1 else 1 / middle), _Unknown("xi", 1e-4, 1.0, 0.1)]
    for i in range(1, modes):  # times over the one before, and weights over that of the first mode
        ratio = (slow / fast) ** (1 / modes)
        found += [_Unknown(f"ratio_{i}", 1e-4, 0.9, ratio), _Unknown(f"weight_{i}", 1e-4, 1e3, 0.5)]
    for name, p in law.parameters().items():
        if p.dimension is not None and p.dimension.unit == "s":
            found.append(_Unknown(name, *times, 1 / middle))
        elif p.dimension is not None and p.dimension.unit == "Pa":
            found.append(_Unknown(name, FARTHEST[0] * slow, FARTHEST[1] * fast * eta / least, slow * eta / least))
        elif not (p.default is not None and not modes):  # exponents and limits that have a default keep it
            found.append(_Unknown(name, *_bounds(p), _inside(p)))
    return found


def _bounds(p: Parameter) -> tuple[float, float]:
    return p.least * (1 + 1e-6) if p.open else p.least, p.most


def _inside(p: Parameter) -> float:
    if p.default is not None:
        return p.default
    return min(10 * p.least, p.most, 0.5 * (p.least + p.most)) if p.least > 0 else min(0.1 * p.most, 0.2)


def _liquid(law: type[ViscousLaw | ConformationLaw], modes: int, values: Mapping[str, float]) -> Liquid:
    sharp = {name: p.most for name, p in law.parameters().items() if name == law.regularisation}
    own = law(**sharp | {name: values[name] for name in law.parameters() if name in values})
    if isinstance(own, ViscousLaw):
        return Liquid(own)
    if modes == 1:
        return Liquid(Newtonian(), values["xi"], values["De"], (own,))
    times = np.cumprod([1.0, *(values[f"ratio_{i}"] for i in range(1, modes))])
    weights = np.array([1.0, *(values[f"weight_{i}"] for i in range(1, modes))])
    each = zip(times.tolist(), (weights / weights.sum()).tolist(), strict=True)
    return Liquid(Newtonian(), values["xi"], values["De"], tuple(replace(own, time=t, weight=w) for t, w in each))


class _Problem:
    """A law with some modes, whose numbers that are not held are to be fitted to data by least squares.

    Raises:
        LookupError: The law has no number of those that are given.
    """

    def __init__(
        self, law: type[ViscousLaw | ConformationLaw], modes: int, data: Measured, given: Mapping[str, float]
    ) -> None:
        self.law, self.modes, self.curves = law, modes, data.curves
        dimensions = dimensions_of(law)
        keys = {name: of.key if of else name for name, of in dimensions.items()}
        if given.keys() - {*keys.values()}:
            raise LookupError
        self._held = {name: given[key] for name, key in keys.items() if key in given}
        own = {name: of for name, of in dimensions.items() if of is not None and name != "eta_0"}
        self._of_viscosity = {
            name: of for name, of in own.items() if name in self._held and of.size(2.0) != of.size(1.0)
        }
        self.unknowns = [each for each in _unknowns(law, modes, data) if each.name not in self._held]

    def values(self, p: Array) -> dict[str, float]:
        """All numbers, from those that are fitted or their logarithms."""
        known = self._held | {each.name: each.number(x) for each, x in zip(self.unknowns, p, strict=True)}
        ratios = {name: self._held[name] / of.size(known["eta_0"]) for name, of in self._of_viscosity.items()}
        return known | {
            name: min(x, 1.0) if self._of_viscosity[name].unit == "Pa*s" else x for name, x in ratios.items()
        }

    def solve(self, guess: Mapping[str, float], fixed: str = "") -> Any:
        """The least squares of the deviations of logarithms, from a first guess, in which one number may be fixed."""
        free = [each for each in self.unknowns if each.name != fixed]
        start = {each.name: np.clip(each.fitted(guess[each.name]), each.low + 1e-9, each.high - 1e-9) for each in free}
        at = {each.name: each.fitted(guess[each.name]) for each in self.unknowns}

        def off(q: Array) -> Array:
            now = at | dict(zip(start, q, strict=True))
            known = self.values(np.array([*now.values()]))
            liquid = _liquid(self.law, self.modes, known)
            with np.errstate(all="ignore"):
                parts = [np.log(_quantity(liquid, known["eta_0"], name, x) / y) for name, x, y in self.curves]
            return np.nan_to_num(np.concatenate(parts), nan=20.0, posinf=20.0, neginf=-20.0).clip(-20, 20)

        bounds = [each.low for each in free], [each.high for each in free]
        return least_squares(off, [*start.values()], bounds=bounds, x_scale="jac", max_nfev=200)

    def end(self, best: Mapping[str, float], unknown: _Unknown, step: float, cost: float) -> float:
        """How far a number may be changed with the others fitted anew, until the least squares reach a cost.

        The sign of `step` is that of the change; infinite where they do not reach it up to the bound of the number.
        """

        def excess(x: float) -> float:
            return self.solve({**best, unknown.name: unknown.number(x)}, unknown.name).cost - cost

        near = unknown.fitted(best[unknown.name])
        while near != (bound := unknown.high if step > 0 else unknown.low):
            far = min(near + step, bound) if step > 0 else max(near + step, bound)
            if excess(far) > 0:
                return float(brentq(excess, near, far, xtol=abs(step) / 20, rtol=1e-3))
            near, step = far, 2 * step
        return float(np.copysign(np.inf, step))


def _fitted(
    law: type[ViscousLaw | ConformationLaw], modes: int, data: Measured, given: Mapping[str, float]
) -> Fit | None:
    """The law fitted to the data; None where it has as many numbers as there are data, or not those that are given."""
    count = sum(len(x) for _, x, _ in data.curves)
    try:
        problem = _Problem(law, modes, data, given)
        if not 0 < len(problem.unknowns) < count:
            return None
        best = problem.solve({each.name: each.guess for each in problem.unknowns})
    except (LookupError, np.linalg.LinAlgError, ValueError):
        return None
    mean, known = float(2 * best.cost / count), problem.values(best.x)
    criterion = count * np.log(max(mean, 1e-12)) + len(problem.unknowns) * np.log(count)
    liquid = _liquid(law, modes, known)
    return Fit(law, liquid, known["eta_0"], known, np.sqrt(mean), float(criterion), problem, best)


def described(fit: Fit, data: Measured) -> bool:
    """Whether a law describes the data: what it leaves is of the size of their scatter."""
    return fit.deviation <= NOT_DESCRIBED * scatter(data)

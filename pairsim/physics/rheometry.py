"""Liquids fitted to what a rheometer measures: flow curves, normal stresses, and moduli of small oscillations.

Quantities are in SI units: a liquid is evaluated with U_av/D_c = 1/s, so that De is its relaxation time in s, and eta_0
times what it says is its stress in Pa. Deviations are those of logarithms, which weighs all decades alike.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.optimize import brentq, least_squares
from scipy.stats import t as student

from pairsim.physics.homogeneous import moduli, steady_shear
from pairsim.physics.liquids import LAWS, ConformationLaw, Liquid, Newtonian, ViscousLaw
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.material import Dimension, Parameter
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
YIELDS = 0.15  # d log stress / d log rate over the slowest decade, below which the stress has a limit at rest; chosen


@dataclass(frozen=True)
class Measured:
    """What was measured.

    Attributes:
        rate: Shear rates of the flow curve [1/s], (n,).
        viscosity: Viscosities there [Pa s], (n,).
        N1: First normal stress differences there [Pa], (n,), NaN where not measured.
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
        all_ = [("viscosity", self.rate, self.viscosity), ("N1", self.rate, self.N1)]
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

    @property
    def yields(self) -> bool:
        """Whether the shear stress is about constant at the slowest rates."""
        slow = self.rate <= 10 * self.rate.min() if len(self.rate) else np.zeros(0, dtype=bool)
        if slow.sum() < 2 or np.ptp(self.rate[slow]) == 0:
            return False
        stress = self.rate[slow] * self.viscosity[slow]
        return bool(np.polyfit(np.log(self.rate[slow]), np.log(stress), 1)[0] < YIELDS)


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

    @property
    def determined(self) -> bool:
        return bool(np.isfinite([self.least, self.most]).any())


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
        number is changed until the squares are too large for the probability.
        """
        problem, x = self._problem, self._best.x
        quantile = student.ppf((1 + CONFIDENCE) / 2, problem.free)
        variance = max(2 * self._best.cost, problem.count * 1e-12) / problem.free
        sizes = np.maximum(np.linalg.norm(self._best.jac, axis=0), SINGULAR)
        scaled = self._best.jac / sizes
        inverse = np.linalg.inv(scaled.T @ scaled + SINGULAR**2 * np.eye(len(x)))
        half = quantile * np.sqrt(variance * np.diagonal(inverse)) / sizes
        cost = self._best.cost + quantile**2 * variance / 2
        found = {name: Number(value, value, value) for name, value in self.values.items()}
        for i, (unknown, h) in enumerate(zip(problem.unknowns, half, strict=True)):
            width = DOUBTFUL if unknown.logarithmic else DOUBTFUL * (problem.high[i] - problem.low[i])
            ends = [x[i] - h, x[i] + h]
            if h > width:
                ends = [problem.end(x, i, sign * min(h, width), cost) for sign in (-1, 1)]
            least, most = ends
            found[unknown.name] = Number(
                unknown.number(x[i]),
                unknown.number(least) if least > problem.low[i] else -np.inf,
                unknown.number(most) if most < problem.high[i] else np.inf,
            )
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
    found = [fit for law in tried for fit in _of_law(law, data, given)]
    return sorted(found, key=lambda fit: fit.criterion)


def _of_law(law: type[ViscousLaw | ConformationLaw], data: Measured, given: Mapping[str, float]) -> Iterator[Fit]:
    """A law fitted to data, by one mode or, where moduli are known, by as many as improve it."""
    modes = 0 if issubclass(law, ViscousLaw) else 1
    best = _fitted(law, modes, data, given)
    while modes and len(data.frequency) and modes < MOST_MODES:
        modes += 1
        better = _fitted(law, modes, data, given)
        if better is None or best is None or better.criterion >= best.criterion:
            break
        best = better
    if best is not None:
        yield best


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

    def fitted(self, value: float) -> float:
        return float(np.log(value)) if self.logarithmic else value

    def number(self, fitted: float) -> float:
        return float(np.exp(fitted)) if self.logarithmic else float(fitted)


def dimensions_of(law: type[ViscousLaw | ConformationLaw]) -> dict[str, Dimension | None]:
    """The measurable quantity of each number of a liquid of a law, None for those that are pure numbers."""
    measured = law.measured if issubclass(law, ViscousLaw) else ZERO_SHEAR
    of_polymer = {} if issubclass(law, ViscousLaw) else Liquid.OF_POLYMER
    return {"eta_0": measured} | {name: p.dimension for name, p in {**of_polymer, **law.parameters()}.items()}


def _held(law: type[ViscousLaw | ConformationLaw], given: Mapping[str, float]) -> dict[str, float]:
    """The numbers of a liquid that are given, in SI units: those that are ratios of viscosities are viscosities.

    Raises:
        LookupError: The law has no such number.
    """
    keys = {name: of.key if of else name for name, of in dimensions_of(law).items()}
    if strange := given.keys() - {*keys.values()}:
        raise LookupError(", ".join(sorted(strange)))
    return {name: given[key] for name, key in keys.items() if key in given}


def _unknowns(
    law: type[ViscousLaw | ConformationLaw], modes: int, data: Measured, held: Collection[str]
) -> list[_Unknown]:
    """The numbers of a liquid that are not held, with first guesses from the data."""
    rates = np.concatenate([x for _, x, _ in data.curves])
    slow, fast, middle = rates.min(), rates.max(), float(np.exp(np.log(rates).mean()))
    eta = data.viscosity.max() if len(data.viscosity) else float((data.loss / data.frequency).max())
    times = FARTHEST[0] / fast, FARTHEST[1] / slow
    found = [_Unknown("eta_0", 1e-3 * eta, 1e3 * eta, eta)]
    if modes:
        found += [_Unknown("De", *times, 1 / slow if modes > 1 else 1 / middle), _Unknown("xi", 1e-4, 1.0, 0.1)]
    for i in range(1, modes):  # times over the one before, and weights over that of the first mode
        ratio = (slow / fast) ** (1 / modes)
        found += [_Unknown(f"ratio_{i}", 1e-4, 0.9, ratio), _Unknown(f"weight_{i}", 1e-4, 1e3, 0.5)]
    for name, p in law.parameters().items():
        if p.dimension is not None and p.dimension.unit == "s":
            found.append(_Unknown(name, *times, 1 / middle))
        elif not (p.default is not None and not modes):  # exponents and limits that have a default keep it
            found.append(_Unknown(name, *_bounds(p), _inside(p)))
    return [each for each in found if each.name not in held]


def _bounds(p: Parameter) -> tuple[float, float]:
    return p.least * (1 + 1e-6) if p.open else p.least, p.most


def _inside(p: Parameter) -> float:
    if p.default is not None:
        return p.default
    return min(10 * p.least, p.most, 0.5 * (p.least + p.most)) if p.least > 0 else min(0.1 * p.most, 0.2)


def _liquid(law: type[ViscousLaw | ConformationLaw], modes: int, values: Mapping[str, float]) -> Liquid:
    own = law(**{name: values[name] for name in law.parameters() if name in values})
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
        self.held = _held(law, given)
        self.unknowns = _unknowns(law, modes, data, self.held)
        self.count = sum(len(x) for _, x, _ in self.curves)
        self.free = self.count - len(self.unknowns)
        of_viscosity = (name for name, of in dimensions_of(law).items() if of and of.unit == "Pa*s")
        self._ratios = [name for name in of_viscosity if name in self.held and name != "eta_0"]
        low, high = ([u.fitted(getattr(u, end)) for u in self.unknowns] for end in ("least", "most"))
        self.low, self.high = np.array(low), np.array(high)

    def values(self, p: Array) -> dict[str, float]:
        """All numbers, from those that are fitted or their logarithms."""
        known = self.held | {each.name: each.number(x) for each, x in zip(self.unknowns, p, strict=True)}
        return known | {name: min(self.held[name] / known["eta_0"], 1.0) for name in self._ratios}

    def off(self, p: Array) -> Array:
        """Deviations of the logarithms."""
        known = self.values(p)
        liquid = _liquid(self.law, self.modes, known)
        with np.errstate(all="ignore"):
            parts = [np.log(_quantity(liquid, known["eta_0"], name, x) / y) for name, x, y in self.curves]
        return np.nan_to_num(np.concatenate(parts), nan=20.0, posinf=20.0, neginf=-20.0).clip(-20, 20)

    def solve(self, start: Array, fixed: int | None = None) -> Any:
        """The least squares from a first guess, in which one of the numbers may be fixed."""
        free = np.arange(len(start)) != fixed

        def off(q: Array) -> Array:
            p = start.copy()
            p[free] = q
            return self.off(p)

        if not free.any():
            return SimpleNamespace(x=start[free], cost=float(np.sum(self.off(start) ** 2) / 2))
        low, high = self.low[free], self.high[free]
        inside = np.clip(start[free], low + 1e-9, high - 1e-9)
        return least_squares(off, inside, bounds=(low, high), x_scale="jac", max_nfev=200)

    def end(self, best: Array, i: int, step: float, cost: float) -> float:
        """How far a number may be changed with the others fitted anew, until the least squares reach a cost.

        The sign of `step` is that of the change; infinite where they do not reach it up to the bound of the number.
        """
        bound = self.high[i] if step > 0 else self.low[i]
        near, p = float(best[i]), best.copy()

        def excess(x: float) -> float:
            p[i] = x
            p[np.arange(len(p)) != i] = (found := self.solve(p, i)).x
            return found.cost - cost

        while near != bound:
            far = float(np.clip(near + step, self.low[i], self.high[i]))
            if excess(far) > 0:
                return float(brentq(excess, near, far, xtol=abs(step) / 20, rtol=1e-3))
            near, step = far, 2 * step
        return float(np.copysign(np.inf, step))


def _fitted(
    law: type[ViscousLaw | ConformationLaw], modes: int, data: Measured, given: Mapping[str, float]
) -> Fit | None:
    """The law fitted to the data; None where it has as many numbers as there are data, or not those that are given."""
    try:
        problem = _Problem(law, modes, data, given)
        if not problem.unknowns or problem.free <= 0:
            return None
        best = problem.solve(np.array([u.fitted(u.guess) for u in problem.unknowns]))
    except (LookupError, np.linalg.LinAlgError, ValueError):
        return None
    squares, count = float(2 * best.cost), problem.count
    known = problem.values(best.x)
    criterion = count * np.log(max(squares / count, 1e-12)) + len(problem.unknowns) * np.log(count)
    deviation = float(np.sqrt(squares / count))
    return Fit(law, _liquid(law, modes, known), known["eta_0"], known, deviation, float(criterion), problem, best)


def described(fit: Fit, data: Measured) -> bool:
    """Whether a law describes the data: what it leaves is of the size of their scatter."""
    return fit.deviation <= NOT_DESCRIBED * scatter(data)

"""Liquids fitted to what a rheometer measures: flow curves, normal stresses, and moduli of small oscillations.

Quantities are in SI units: a liquid is evaluated with U_av/D_c = 1/s, so that De is its relaxation time in s, and its
dimensionless stress times eta_0 is its stress in Pa. Deviations are those of logarithms, which gives all decades the
same weight.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.special import stdtrit

from pairsim.lab.rheometer.derivatives import Sheared, numbers_of, slopes
from pairsim.lab.rheometer.measured import Measured, of_liquid, scatter
from pairsim.physics.liquids import LAWS, ConformationLaw, Liquid, Newtonian, ViscousLaw
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.material import Material
from pairsim.quantities.kinds import STRESS, TIME, VISCOSITY
from pairsim.quantities.measurable import Measurable
from pairsim.runtime.arrays import Array

CONFIDENCE = 0.95
SINGULAR = 1e-9  # added to the diagonal of J^T J: data may not determine a number, or a combination of several
MOST_STEPS, NEAR_ENOUGH = 20, 0.03  # for the end of an interval, and how near, over its half-width; chosen
MOST_MODES = 4
LOGARITHMIC = 100.0  # ratio of the bounds of a parameter from which its logarithm is fitted; chosen
FARTHEST = 1e-3, 1e3  # bounds of relaxation times over the inverse of the fastest and of the slowest rate; chosen
NOT_DESCRIBED = 3.0  # deviation over the scatter of the data above which no law is said to describe them; chosen
CLOSE = 0.02  # deviation below which a law describes any data: rheometers are not better than this; chosen
SMALLEST = 1e-12  # least part of the solvent in the viscosity, and least weight of further modes over the first; chosen
FURTHER_MODE = 0.1  # time and weight of one more mode over those of the last one, as a first guess; chosen
AT_BOUND = 0.01  # distance of a logarithm from its bound below which it counts as being there; chosen
INSIDE = 1e-3  # relative distance from a bound that is itself excluded: numbers of cases are rounded to four digits
MOST_OFF = 20.0  # bound of deviations, also where a law gives no number; chosen
DIFFERENCE = 1e-7  # step of a fitted number, or its logarithm, for derivatives of the liquid's numbers; chosen
# Positive and very strong evidence by the Bayesian information criterion (Kass and Raftery 1995).
EVIDENCE, STRONG = 2.0, 10.0


@dataclass(frozen=True)
class Number:
    """A number of a fitted liquid.

    Attributes:
        value: Its value.
        least, most: The interval in which it lies with a probability of 95 %, if the law describes the liquid. Ends
            that the data do not determine are infinite; of a number that was given both are its value.
    """

    value: float
    least: float
    most: float

    @property
    def given(self) -> bool:
        return self.least == self.most


def fits(data: Measured, laws: Sequence[str] | None = None, given: Mapping[str, float] | None = None) -> list[Fit]:
    """Fits of all laws that the data can determine, the best first; arguments are those of `each_fit`."""
    return ranked({fit.law: fit for fit in each_fit(data, laws, given)}.values())


def ranked(fits: Iterable[Fit]) -> list[Fit]:
    """Fits in the order of their criterion, the best first; equally good ones stay in their order."""
    return sorted(fits, key=lambda fit: round(fit.criterion, 1))


def tried(data: Measured, laws: Sequence[str] | None = None, given: Mapping[str, float] | None = None) -> list[str]:
    """The names of the laws that `each_fit` tries: those that can be fitted to the data; arguments are the same."""
    given, found = given or {}, []
    elastic = data.kinds & {"N1", "storage"} or given.keys() & {"relaxation", "solvent"}
    kind = ConformationLaw if elastic else ViscousLaw
    for name in laws or [name for name, law in LAWS.items() if issubclass(law, kind)]:
        with suppress(ValueError):
            _given_and_unknown(LAWS[name], int(issubclass(LAWS[name], ConformationLaw)), data, given)
            found.append(name)
    return found


def each_fit(
    data: Measured, laws: Sequence[str] | None = None, given: Mapping[str, float] | None = None
) -> Iterator[Fit]:
    """Fit one law after the other to data, and each with ever more modes as long as they improve it.

    Args:
        data: What was measured.
        laws: Names of laws to be tried; None for all viscoelastic ones if the data or the given numbers show
            elasticity, else for all without a memory.
        given: Numbers that are known, in SI units by the key of their dimension (viscosity, solvent, relaxation), or
            by name.
    """
    for name in tried(data, laws, given):
        yield from _of_law(LAWS[name], data, given or {})


def _of_law(law: type[ViscousLaw | ConformationLaw], data: Measured, given: Mapping[str, float]) -> Iterator[Fit]:
    """A law fitted to data, by one mode and, where moduli are known, by as many as improve it."""
    best = None
    for modes in [0] if issubclass(law, ViscousLaw) else range(1, MOST_MODES + 1 if len(data.frequency) else 2):
        try:
            fit = Fit(law, modes, data, given, best)
        except (np.linalg.LinAlgError, ValueError):
            return
        if best is not None and fit.criterion >= best.criterion:
            return
        best = fit
        yield best


def dimensions_of(law: type[ViscousLaw | ConformationLaw]) -> dict[str, Measurable | None]:
    """The measurable quantity of each number of a liquid of a law, None for those that are pure numbers."""
    measured = law.measured if issubclass(law, ViscousLaw) else ZERO_SHEAR
    of_polymer = {} if issubclass(law, ViscousLaw) else Liquid.OF_POLYMER
    return {"eta_0": measured} | {name: p.dimension for name, p in {**of_polymer, **law.parameters()}.items()}


def _unknowns(law: type[Material], modes: int, data: Measured) -> dict[str, tuple[float, float, float]]:
    """Lower bound, upper bound and first guess of each number of a liquid, by its name, from the data."""
    rates = np.concatenate([x for _, x, _ in data.curves])
    slow, fast, middle = rates.min(), rates.max(), float(np.exp(np.log(rates).mean()))
    viscosities = data.viscosity if len(data.viscosity) else data.loss / data.frequency
    least, eta = float(viscosities.min()), float(viscosities.max())
    largest = max([eta, *(np.hypot(data.storage, data.loss) / data.frequency)])  # of a gel, whose loss is small
    times = FARTHEST[0] / fast, FARTHEST[1] / slow
    # For a liquid that yields eta_0 is the viscosity where it flows fast.
    yields = any(p.dimension is not None and p.dimension.kind == STRESS for p in law.parameters().values())
    found = {"eta_0": (1e-3 * least, 1e3 * largest, least if yields else eta)}
    if modes:
        usual = Liquid.OF_POLYMER["xi"].least
        found |= {"De": (*times, 1 / slow if modes > 1 else 1 / middle), "xi": (usual, 1.0, 0.1)}
    for i in range(2, modes + 1):  # over the time and weight of the first mode
        ratio = (slow / fast) ** ((i - 1) / modes)
        shortest = max(times[0] / times[1], ConformationLaw.OF_MODE["time"].least)
        found |= {f"time_{i}": (shortest, 0.9, ratio), f"weight_{i}": (SMALLEST, 1e3, 0.5 ** (i - 1))}
    for name, p in law.parameters().items():
        if p.dimension is not None and p.dimension.kind == TIME:
            found[name] = (*times, 1 / middle)
        elif p.dimension is not None and p.dimension.kind == STRESS:
            found[name] = (FARTHEST[0] * slow, FARTHEST[1] * fast * eta / least, slow * eta / least)
        elif p.default is None or modes:  # exponents and limits that have a default keep it in liquids without modes
            usual = min(10 * p.least, p.most, 0.5 * (p.least + p.most)) if p.least > 0 else min(0.1 * p.most, 0.2)
            guess = usual if p.default is None else p.default
            found[name] = (p.least + INSIDE * abs(p.least) if p.open else p.least, p.most, guess)
    return found


def _given_and_unknown(
    law: type[ViscousLaw | ConformationLaw], modes: int, data: Measured, given: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, tuple[float, float, float]]]:
    """The numbers of a law that are given, and the bounds and first guesses of the others; ValueError as in `Fit`."""
    keys = {name: of.key if of else name for name, of in dimensions_of(law).items()}
    known = {name: given[key] for name, key in keys.items() if key in given}
    unknown = {name: each for name, each in _unknowns(law, modes, data).items() if name not in known}
    if given.keys() - {*keys.values()} or not 0 < len(unknown) < data.count:
        raise ValueError(f"{law.label} cannot be fitted")
    return known, unknown


def _liquid(law: type[ViscousLaw | ConformationLaw], modes: int, values: Mapping[str, float]) -> Liquid:
    sharp = {name: p.most for name, p in law.parameters().items() if name == law.regularisation}
    own = law(**sharp | {name: values[name] for name in law.parameters() if name in values})
    if isinstance(own, ViscousLaw):
        return Liquid(own)
    each = [(values.get(f"time_{i}", 1.0), values.get(f"weight_{i}", 1.0)) for i in range(1, modes + 1)]
    total = sum(weight for _, weight in each)
    parts = tuple(replace(own, time=time, weight=weight / total) for time, weight in each)
    return Liquid(Newtonian(), values["xi"], values["De"], parts)


class Fit:
    """A law with some modes, whose numbers that are not given are fitted to data by least squares.

    Attributes:
        law: Its class.
        values: Its numbers by name: eta_0, De (the longest relaxation time), xi, those of the law, and the times and
            weights of modes.
        liquid: The liquid in SI units, as this module has them.
        eta_0: Its unit of viscosity [Pa s], or consistency [Pa s^n].
        deviation: Root mean square of the deviations of logarithms.
        criterion: Bayesian information criterion (Schwarz 1978); the smaller, the better.

    Raises:
        ValueError: The law does not have the numbers that are given, has no unknown ones, or has no fewer of them than
            there are data.
    """

    def __init__(
        self,
        law: type[ViscousLaw | ConformationLaw],
        modes: int,
        data: Measured,
        given: Mapping[str, float],
        before: Fit | None = None,
    ) -> None:
        self.law, self._modes, curves = law, modes, data.curves
        self._at, self._measured = {name: x for name, x, _ in curves}, np.concatenate([y for _, _, y in curves])
        self._given, unknowns = _given_and_unknown(law, modes, data, given)
        count = data.count
        self._names, table = [*unknowns], np.array([*unknowns.values()]).T
        self._logarithmic = (table[0] > 0) & (table[1] > LOGARITHMIC * table[0])
        with np.errstate(all="ignore"):
            self._least, self._most, guess = np.where(self._logarithmic, np.log(table), table)
            starts = [guess]
            if before is not None:
                known = before.with_a_mode()
                found = np.array([known[name] for name in self._names])
                starts.append(np.where(self._logarithmic, np.log(found), found))
        self._memory = Sheared()
        self._best = self._solved_from(starts)
        if "xi" in self._names:
            self._widen(self._names.index("xi"), starts, count)
        self._sort_modes()
        self.values = self._numbers(self._best.x)
        self.liquid, self.eta_0 = _liquid(law, modes, self.values), self.values["eta_0"]
        mean = float(2 * self._best.cost / count)
        self.deviation = float(np.sqrt(mean))
        self.criterion = float(count * np.log(max(mean, 1e-12)) + len(unknowns) * np.log(count))

    def with_a_mode(self) -> dict[str, float]:
        """First guess for a fit with one more mode: its numbers, and a mode that is faster and weaker than the last."""
        last = {name: self.values.get(f"{name}_{self._modes}", 1.0) for name in ("time", "weight")}
        return self.values | {f"{name}_{self._modes + 1}": FURTHER_MODE * value for name, value in last.items()}

    def _sort_modes(self) -> None:
        """Put the further modes into the order of their times, the longest first."""
        further = range(2, self._modes + 1)
        times = [self._best.x[self._names.index(f"time_{i}")] for i in further]
        order = np.arange(len(self._names))
        for i, k in zip(further, np.argsort(times)[::-1] + 2, strict=True):
            for name in ("time", "weight"):
                order[self._names.index(f"{name}_{i}")] = self._names.index(f"{name}_{k}")
        self._best.x, self._best.jac = self._best.x[order], self._best.jac[:, order]

    def _widen(self, i: int, starts: Sequence[Array], count: int) -> None:
        """Lower the bound of number `i` below that of a case if the data show that it is smaller, as for a gel.

        Without evidence for this the number keeps to the bound of a case.
        """
        least, usual = self._least[i], self._best
        if usual.x[i] - least > AT_BOUND:
            return
        self._least[i] = np.log(SMALLEST)
        wide = self._solved_from([*starts, usual.x])
        if count * np.log(usual.cost / wide.cost) > EVIDENCE:
            self._best = wide
        else:
            self._least[i] = least

    @cached_property
    def numbers(self) -> dict[str, Number]:
        """Its numbers with their intervals, from the profile of the sum of squares."""
        found = {name: Number(value, value, value) for name, value in self.values.items()}
        return found | {name: self._interval(i) for i, name in enumerate(self._names)}

    def of(self, quantity: str, x: Array) -> Array:
        """A quantity of `Measured` as the liquid has it [SI], at shear rates or frequencies."""
        return of_liquid(self.liquid, self.eta_0, {quantity: x})[quantity]

    def _numbers(self, x: Array) -> dict[str, float]:
        """All numbers, from those that are fitted or their logarithms."""
        known = self._given | dict(zip(self._names, np.where(self._logarithmic, np.exp(x), x).tolist(), strict=True))
        for name, of in dimensions_of(self.law).items():
            if of is not None and name in self._given and name != "eta_0":
                known[name] = self._given[name] / of.size(known["eta_0"])
                known[name] = min(known[name], 1.0) if of.kind == VISCOSITY else known[name]
        return known

    def _deviations(self, x: Array) -> Array:
        """Differences of the logarithms of the quantities from those of the data, (data,)."""
        known = self._numbers(x)
        liquid = _liquid(self.law, self._modes, known)
        with np.errstate(all="ignore"):
            parts = of_liquid(liquid, known["eta_0"], self._at, self._memory)
            found = np.log(np.concatenate([*parts.values()]) / self._measured)
        return np.nan_to_num(found, nan=MOST_OFF, posinf=MOST_OFF, neginf=-MOST_OFF).clip(-MOST_OFF, MOST_OFF)

    def _slopes(self, x: Array) -> Array:
        """The derivatives of the deviations by the numbers that are fitted, or their logarithms, (data, fitted)."""

        def plain(x: Array) -> tuple[Liquid, Array]:
            known = self._numbers(x)
            liquid = _liquid(self.law, self._modes, known)
            return liquid, numbers_of(liquid, known["eta_0"])

        liquid, at = plain(x)
        moved = [(plain(x + d)[1] - at) / DIFFERENCE for d in DIFFERENCE * np.eye(len(x))]
        with np.errstate(all="ignore"):
            found = slopes(liquid, self._at, self._memory) @ np.array(moved).T
        return np.nan_to_num(found, nan=0.0, posinf=0.0, neginf=0.0)

    def _solved_from(self, starts: Sequence[Array]) -> Any:
        """The solution with the least sum of squares of those from several first guesses."""
        return min((self._solved(start) for start in starts), key=lambda found: float(found.cost))

    def _solved(self, start: Array, held: int | None = None) -> Any:
        """The least-squares solution from a first guess; the number `held`, an index, keeps its value there."""
        free = np.arange(len(start)) != held

        def deviations(x: Array) -> Array:
            all_ = start.copy()
            all_[free] = x
            return self._deviations(all_)

        def derivatives(x: Array) -> Array:
            all_ = start.copy()
            all_[free] = x
            return self._slopes(all_)[:, free]

        bounds = self._least[free], self._most[free]
        inside = np.clip(start[free], bounds[0] + 1e-9, bounds[1] - 1e-9)
        jac = derivatives if self._modes else "2-point"
        return least_squares(deviations, inside, jac, bounds, x_scale="jac", ftol=1e-6, xtol=1e-6, max_nfev=200)

    def _interval(self, i: int) -> Number:
        """Number `i` with its interval, at whose ends the cost, with the others fitted anew, has risen to its limit."""
        best = self._best
        count, fitted = best.jac.shape
        quantile = stdtrit(count - fitted, (1 + CONFIDENCE) / 2)  # of Student's distribution
        most = quantile**2 * max(best.cost, count * 1e-12) / (count - fitted)  # what the cost may rise by
        covariance = np.linalg.inv(best.jac.T @ best.jac + SINGULAR * np.eye(fitted))
        half = float(np.sqrt(2 * most * covariance[i, i]))

        def rise(step: float, near: Array) -> tuple[float, Array]:
            """The rise of the cost with the number fixed a step away from its best value, and all numbers there."""
            moved = step * covariance[i] / covariance[i, i]
            held = [best.x + moved, near.copy()]  # the first is the better guess unless a number is hardly determined
            for each in held:
                each[i] = best.x[i] + step
            at = min(held, key=lambda each: float(np.sum(self._deviations(each.clip(self._least, self._most)) ** 2)))
            if fitted > 1:
                found = self._solved(at, held=i)
                at[np.arange(fitted) != i], cost = found.x, found.cost
            else:
                cost = np.sum(self._deviations(at) ** 2) / 2
            return float(max(cost - best.cost, 1e-9 * most)), at

        def end(sign: float, bound: float) -> float:
            inside, outside, farthest = 0.0, np.inf, abs(bound - best.x[i])
            step, near = min(half, farthest), best.x
            for _ in range(MOST_STEPS):
                rises, at = rise(sign * step, near) if step else (0.0, near)
                near = at if rises < most else near
                factor = np.sqrt(most / rises) if step else np.inf  # the cost is about a parabola
                if factor > 1 and step == farthest:
                    return float(sign * np.inf)
                if abs(factor - 1) < NEAR_ENOUGH:
                    break
                inside, outside = (step, outside) if factor > 1 else (inside, step)
                step = min(factor * step, farthest)
                if not inside < step < outside:
                    step = (inside + outside) / 2
            return float(best.x[i] + sign * step)

        ends = best.x[i], end(-1.0, self._least[i]), end(1.0, self._most[i])
        return Number(*(float(np.exp(x)) if self._logarithmic[i] and np.isfinite(x) else float(x) for x in ends))


def described(fit: Fit, data: Measured) -> bool:
    """Whether a law describes the data: its deviations are comparable with their scatter, or small."""
    return fit.deviation <= max(NOT_DESCRIBED * scatter(data), CLOSE)


def as_good(best: Fit, others: Iterable[Fit]) -> list[Fit]:
    """The other fits against which the data have no strong evidence."""
    return [fit for fit in others if fit.criterion - best.criterion < STRONG]

"""Liquids fitted to what a rheometer measures: flow curves, normal stresses, and moduli of small oscillations.

Quantities are in SI units: a liquid is evaluated with U_av/D_c = 1/s, so that De is its relaxation time in s, and eta_0
times what it says is its stress in Pa. Deviations are those of logarithms, which weighs all decades alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from pairsim.physics.homogeneous import moduli, steady_shear
from pairsim.physics.liquids import LAWS, ConformationLaw, Liquid, Newtonian, ViscousLaw
from pairsim.physics.material import Material, Parameter
from pairsim.runtime.arrays import Array

CONFIDENCE = 0.95
MOST_MODES = 4
LOGARITHMIC = 100.0  # ratio of the bounds of a parameter from which its logarithm is fitted; chosen
FARTHEST = 1e-3, 1e3  # bounds of relaxation times over the inverse of the slowest and fastest rate; chosen
NOT_DESCRIBED = 3.0  # deviation over the scatter of the data above which no law is said to describe them; chosen
LEAST_SCATTER = 0.005  # of the logarithms: what no rheometer does better than; chosen


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
    def elastic(self) -> bool:
        """Whether the data show elasticity."""
        return any(name in ("N1", "storage") for name, _, _ in self.curves)


@dataclass(frozen=True)
class Number:
    """A fitted number.

    Attributes:
        value: Its value.
        least, most: The interval in which it lies with a probability of 95 %, if the law describes the liquid.
    """

    value: float
    least: float
    most: float


@dataclass(frozen=True)
class Fit:
    """A law fitted to data.

    Attributes:
        law: Its class.
        liquid: The liquid in SI units, see above.
        eta_0: Its unit of viscosity [Pa s], or consistency [Pa s^n].
        numbers: The fitted numbers by name: eta_0, De (the longest relaxation time), xi, those of the law, and the
            times and weights of modes.
        deviation: Root mean square of the deviations of logarithms.
        criterion: Bayesian information criterion (Schwarz 1978); the smaller, the better.
    """

    law: type[ViscousLaw | ConformationLaw]
    liquid: Liquid
    eta_0: float
    numbers: dict[str, Number]
    deviation: float
    criterion: float

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
    """What neighbouring points of the curves differ by, root mean square of the logarithms."""
    squares = [np.diff(np.log(y), 2) ** 2 / 6 for _, x, y in data.curves if len(y) > 3]
    return max(float(np.sqrt(np.median(np.concatenate(squares)) / 0.455)) if squares else 0.0, LEAST_SCATTER)


def fits(data: Measured, laws: Sequence[str] | None = None) -> list[Fit]:
    """All laws that the data can tell, fitted to them, the best first.

    Args:
        data: What was measured.
        laws: Names of laws to be tried; None for all of the kind that the data show.
    """
    kind = ConformationLaw if data.elastic else ViscousLaw
    tried = [LAWS[name] for name in laws] if laws else [law for law in LAWS.values() if issubclass(law, kind)]
    found = [fit for law in tried for fit in _of_law(law, data)]
    return sorted(found, key=lambda fit: fit.criterion)


def _of_law(law: type[ViscousLaw | ConformationLaw], data: Measured) -> Iterator[Fit]:
    """A law fitted to data, by one mode or, where moduli are known, by as many as improve it."""
    modes = 0 if issubclass(law, ViscousLaw) else 1
    best = _fitted(law, modes, data)
    while modes and len(data.frequency) and modes < MOST_MODES:
        modes += 1
        better = _fitted(law, modes, data)
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


def _unknowns(law: type[Material], modes: int, data: Measured) -> list[_Unknown]:
    """The numbers of a liquid, with first guesses from the data."""
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
    return found


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


def _fitted(law: type[ViscousLaw | ConformationLaw], modes: int, data: Measured) -> Fit | None:
    """The law fitted to the data; None where it has as many numbers as there are data."""
    unknowns, curves = _unknowns(law, modes, data), data.curves
    count = sum(len(x) for _, x, _ in curves)
    if count <= len(unknowns):
        return None

    def values(p: Array) -> dict[str, float]:
        return {each.name: each.number(x) for each, x in zip(unknowns, p, strict=True)}

    def off(p: Array) -> Array:
        known = values(p)
        liquid = _liquid(law, modes, known)
        with np.errstate(all="ignore"):
            parts = [np.log(_quantity(liquid, known["eta_0"], name, x) / y) for name, x, y in curves]
        return np.nan_to_num(np.concatenate(parts), nan=20.0, posinf=20.0, neginf=-20.0).clip(-20, 20)

    low, high = (np.array([u.fitted(getattr(u, end)) for u in unknowns]) for end in ("least", "most"))
    start = np.clip([u.fitted(u.guess) for u in unknowns], low + 1e-9, high - 1e-9)
    try:
        best = least_squares(off, start, bounds=(low, high), x_scale="jac", max_nfev=200)
    except (np.linalg.LinAlgError, ValueError):
        return None
    squares, free = float(2 * best.cost), count - len(unknowns)
    variance = np.linalg.pinv(best.jac.T @ best.jac) * max(squares, count * 1e-12) / free
    half = student.ppf((1 + CONFIDENCE) / 2, free) * np.sqrt(np.diagonal(variance))
    numbers = {
        u.name: Number(u.number(x), u.number(max(x - h, lo)), u.number(min(x + h, hi)))
        for u, x, h, lo, hi in zip(unknowns, best.x, half, low, high, strict=True)
    }
    known = values(best.x)
    criterion = count * np.log(max(squares / count, 1e-12)) + len(unknowns) * np.log(count)
    return Fit(law, _liquid(law, modes, known), known["eta_0"], numbers, np.sqrt(squares / count), float(criterion))


def described(fit: Fit, data: Measured) -> bool:
    """Whether a law describes the data: what it leaves is of the size of their scatter."""
    return fit.deviation <= NOT_DESCRIBED * scatter(data)

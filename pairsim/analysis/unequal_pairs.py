"""Pairs whose particles differ: the spread of dU that follows from it, and the fraction of pairs that make a travel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol, Self

import numpy as np

from pairsim.quantities.kinds import LENGTH, POSITION, VELOCITY
from pairsim.quantities.scales import Scales
from pairsim.quantities.text import in_unit, with_name
from pairsim.record.columns import BY_BETA, BY_CA_E, BY_DIFFERENCE, BY_STIFFNESS, DISTANCE
from pairsim.record.record import Record
from pairsim.record.run_entries import SPREAD_OF_PARTICLES
from pairsim.record.table import Table
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import CurveInterpolant, hermite, slopes_of

BY = {"diameter": (BY_BETA, BY_DIFFERENCE), "modulus": (BY_CA_E, BY_STIFFNESS)}
"""The derivatives of dU by the properties that may differ: by that of both particles, and by their difference."""
DRAWS = 4000  # number of pairs drawn: a fraction of them has a standard error of at most 0.8 %
HALF, MOST = 0.5, 0.9  # fractions of the pairs that arrive for which the length of tube is given


class Pairs(NamedTuple):
    """Relative differences of the particles of pairs from the mean particle, shape (pairs, 2) each.

    The trailing (upstream) particle comes first.
    """

    diameters: Array
    moduli: Array


@dataclass(frozen=True)
class Spread:
    """Standard deviations of diameter and modulus among particles, over their means, and the mean particle."""

    diameter: float
    modulus: float
    beta: float
    Ca_e: float

    @classmethod
    def of(cls, record: Record) -> Self | None:
        """The spread of the particles in run.json; None where all are equal."""
        entry = SPREAD_OF_PARTICLES.of(record)
        return None if entry is None else cls(**entry)

    def draw(self, count: int) -> Pairs:
        """Pairs of independent, normal particles, the same ones at each call."""
        random = np.random.default_rng(0)
        return Pairs(*(each * random.standard_normal((count, 2)) for each in (self.diameter, self.modulus)))

    @property
    def sizes(self) -> dict[str, float]:
        """The standard deviations of the properties that differ, by their names."""
        every = {"diameter": self.diameter, "modulus": self.modulus}
        return {name: part for name, part in every.items() if part}

    @property
    def words(self) -> str:
        """What differs, and by how much, in words."""
        return ", ".join(f"{name} {100 * part:.3g} %" for name, part in self.sizes.items())


class UnequalPairs(Protocol):
    """dU of pairs whose particles differ, however it is known."""

    def dU(self, d: Array, pairs: Pairs) -> Array:
        """dU of pairs at distances (n,) [D_c], shape (pairs, n) [U_av]."""

    def deviations(self, d: Array, spread: Spread) -> Array:
        """Standard deviation of dU among pairs of a spread, at distances (n,) [D_c], shape (n,) [U_av]."""

    def decisive(self, spread: Spread) -> Mapping[str, float]:
        """Relative difference of each property above which its sign determines that of dU at every distance."""


@dataclass(frozen=True)
class ByDerivatives:
    """dU of pairs that hardly differ, from that of two mean particles and its derivatives.

    Attributes:
        curve: dU of two mean particles.
        d: Distances at which derivatives are known, ascending [D_c], shape (points,).
        by_diameters: Derivatives by the diameters of both, and by their difference (the leading minus the trailing
            one), over their mean, shape (2, points) [U_av].
        by_moduli: The same by the moduli; zeros where these do not differ.
    """

    curve: CurveInterpolant
    d: Array
    by_diameters: Array
    by_moduli: Array

    @classmethod
    def of(cls, table: Table, curve: CurveInterpolant, spread: Spread) -> Self:
        """The derivatives of a curve; zeros for properties that do not differ."""
        by = {name: np.zeros((2, table.rows)) for name in BY}
        for name in spread.sizes:
            by[name] = np.array([table[column] for column in BY[name]])
        by["diameter"][0] *= spread.beta
        by["modulus"][0] *= -spread.Ca_e  # the modulus is inverse to it
        return cls(curve, table[DISTANCE], *by.values())

    def dU(self, d: Array, pairs: Pairs) -> Array:
        parts = zip((self.by_diameters, self.by_moduli), pairs, strict=True)
        changes = [_both(each) @ self._at(by, d) for by, each in parts]
        return np.asarray(self.curve.values(d) + np.sum(changes, axis=0))

    def deviations(self, d: Array, spread: Spread) -> Array:
        sizes = spread.diameter, spread.modulus
        # Mean and difference of two independent particles are independent, of variances 1/2 and 2.
        each = zip(sizes, (self.by_diameters, self.by_moduli), strict=True)
        parts = [size**2 * np.array([0.5, 2.0]) @ self._at(by, d) ** 2 for size, by in each]
        return np.asarray(np.sqrt(np.sum(parts, axis=0)))

    def decisive(self, spread: Spread) -> Mapping[str, float]:
        sizes = {"diameter": (spread.diameter, self.by_diameters), "modulus": (spread.modulus, self.by_moduli)}
        d = self.curve.samples[0]
        equal = np.abs(self.curve.values(d))
        found = {name: (equal, np.abs(self._at(by, d)[1])) for name, (size, by) in sizes.items() if size}
        with np.errstate(divide="ignore"):
            return {name: float((dU / by).max()) for name, (dU, by) in found.items()}

    def _at(self, by: Array, d: Array) -> Array:
        """Derivatives at distances (n,), shape (2, n), interpolated by a cubic over log d."""
        x = np.log(self.d)
        return np.array([hermite(x, each, slopes_of(each, x))(np.log(d)) for each in by])


def _both(each: Array) -> Array:
    """Mean and difference of two particles, from (pairs, 2), shape (pairs, 2)."""
    return np.stack([each.mean(axis=1), each[:, 1] - each[:, 0]], axis=1)


@dataclass(frozen=True)
class PairsTravel:
    """Which pairs that differ move from one distance to another, and within which length of tube.

    Attributes:
        start: First distance [D_c].
        stop: Last distance [D_c].
        part: The fraction of pairs that do.
        half: Length of tube within which half of these do [D_c]; nan where none does.
        most: Length of tube within which nine tenths of these do [D_c]; nan where none does.
        spread: How much particles differ.
        scales: The units of the case, None without a `physical` block.
    """

    start: float
    stop: float
    part: float
    half: float
    most: float
    spread: Spread
    scales: Scales | None = None

    def __str__(self) -> str:
        ends = [in_unit(self.scales, LENGTH, d, digits=6) for d in (self.start, self.stop)]
        said = f"of pairs whose particles differ ({self.spread.words}), {_percent(self.part)} of those at d = {ends[0]}"
        if not self.part:
            return f"{said} move to {ends[1]}"
        half, most = (with_name(self.scales, POSITION, each, digits=3) for each in (self.half, self.most))
        return f"{said} move to {ends[1]}: half of these within {half} of tube, nine tenths within {most}"


@dataclass(frozen=True)
class PairsThatDiffer:
    """Pairs of particles with a spread of properties.

    Attributes:
        source: dU of pairs that differ.
        curve: dU of two mean particles.
        spread: How much particles differ, in the properties whose effect on dU is known.
        unknown: Names of the properties that differ, too, but whose effect is not known.
    """

    source: UnequalPairs
    curve: CurveInterpolant
    spread: Spread
    unknown: Sequence[str] = ()

    @classmethod
    def of(cls, table: Table, curve: CurveInterpolant | None, record: Record) -> Self | None:
        """Pairs that differ along a curve; None if all are equal, or if no effect of their differences is known."""
        spread = Spread.of(record)
        if spread is None or curve is None:
            return None
        unknown = [name for name in spread.sizes if not all(table.has(column) for column in BY[name])]
        spread = replace(spread, **dict.fromkeys(unknown, 0.0))
        return cls(ByDerivatives.of(table, curve, spread), curve, spread, unknown) if spread.sizes else None

    def deviations(self, d: Array) -> Array:
        """Standard deviation of dU among pairs, at distances (n,) [D_c], shape (n,) [U_av]."""
        return self.source.deviations(d, self.spread)

    def separate(self, d: Array) -> Array:
        """The fraction of pairs with dU > 0 at distances (n,) [D_c], shape (n,)."""
        ratios = self.curve.values(d) / self.deviations(d)
        return np.array([0.5 + 0.5 * math.erf(each / math.sqrt(2)) for each in ratios])

    def words_at(self, d: float, scales: Scales | None) -> str:
        """The spread of dU among pairs at a distance [D_c], in words."""
        at = np.array([d])
        deviation = in_unit(scales, VELOCITY, float(self.deviations(at)[0]), digits=3)
        part = 100 * float(self.separate(at)[0])
        return f"a standard deviation of {deviation} among pairs, of which {part:.3g} % separate"

    @property
    def decisive(self) -> Mapping[str, float]:
        """The result of `UnequalPairs.decisive` for the spread."""
        return self.source.decisive(self.spread)

    def travel(self, start: float, stop: float, way: Way, scales: Scales | None = None) -> PairsTravel:
        """Let pairs that are drawn move from one distance to another [D_c].

        Args:
            start: First distance.
            stop: Last distance.
            way: The distances between them, with the weights of a quadrature.
            scales: The units of the case.
        """
        dU = self.source.dU(way.d.ravel(), self.spread.draw(DRAWS)) * np.sign(stop - start)
        arrive = (dU > 0).all(axis=1)
        lengths = (way.weights * way.velocity).ravel() @ (1 / dU[arrive]).T
        half, most = np.quantile(lengths, [HALF, MOST]) if arrive.any() else (math.nan, math.nan)
        return PairsTravel(start, stop, float(arrive.mean()), float(half), float(most), self.spread, scales)


class Way(NamedTuple):
    """Distances between two others, with the weights of a quadrature over the distance of the centres."""

    d: Array  # [D_c], of any shape
    weights: Array  # of the same shape [D_c]
    velocity: Array  # mean velocity of a pair there, of the same shape [U_av]


def _percent(part: float) -> str:
    return f"{100 * part:.2g} %" if 0.01 <= part <= 0.99 else f"{100 * part:.1f} %"

"""The functions in which an atlas is written: Chebyshev polynomials of beta, De, Ca_e, and of the distance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from pairsim.runtime.arrays import Array, Indices

PARAMETERS = ("beta", "De", "Ca_e")
BEND = 0.15  # De from which on dU bends: the variable is log(1 + De/BEND); chosen
NEAR = 0.1  # d below which dU changes little: the variable is log(d + NEAR) [D_c]; chosen


@dataclass(frozen=True)
class Basis:
    """Products of Chebyshev polynomials of beta, log(1 + De/BEND) and Ca_e over a box.

    Attributes:
        box: Least and largest value of each parameter.
        degrees: Degrees of the polynomials, shape (terms, 3).
    """

    box: Mapping[str, tuple[float, float]]
    degrees: Indices

    def terms(self, places: Array, vanishing: bool, along: int | None = None) -> Array:
        """All terms or their derivatives, shape (places, terms).

        Args:
            places: beta, De and Ca_e, shape (places, 3).
            vanishing: Whether the terms have their values at De = Ca_e = 0 subtracted. There dU is exactly zero.
            along: Parameter by which the terms are differentiated.
        """
        tables = [self._table(i, places[:, i], i == along) for i in range(3)]
        beta, De, Ca_e = (table[:, self.degrees[:, i]] for i, table in enumerate(tables))
        if not vanishing:
            return np.asarray(beta * De * Ca_e)
        still = [self._table(i, np.zeros(1), False)[:, self.degrees[:, i]] for i in (1, 2)]
        rest = 0.0 if along in (1, 2) else still[0] * still[1]
        return np.asarray(beta * (De * Ca_e - rest))

    def _table(self, parameter: int, values: Array, differentiated: bool) -> Array:
        """Polynomials of one parameter up to the largest degree, or their derivatives by it, (places, degrees)."""
        low, high = self.box[PARAMETERS[parameter]]
        most = int(self.degrees[:, parameter].max())
        if parameter == 1:
            low, high, inner = np.log1p(low / BEND), np.log1p(high / BEND), 1 / (BEND + values)
            values = np.log1p(values / BEND)
        else:
            inner = np.ones_like(values)
        factor = 2 / (high - low)
        table = chebyshev((values - low) * factor - 1, most, differentiated)
        return table * (factor * inner)[:, None] if differentiated else table


def distance_terms(d: Array, ends: tuple[float, float], count: int, differentiated: bool = False) -> Array:
    """Chebyshev polynomials of log(d + NEAR) over the range of distances, or derivatives by d, (places, count)."""
    low, high = (np.log(end + NEAR) for end in ends)
    factor = 2 / (high - low)
    table = chebyshev((np.log(d + NEAR) - low) * factor - 1, count - 1, differentiated)
    return table * (factor / (d + NEAR))[:, None] if differentiated else table


def nodes(ends: tuple[float, float], count: int) -> Array:
    """The distances at which the polynomials of `distance_terms` are determined, ascending, shape (count,)."""
    low, high = (np.log(end + NEAR) for end in ends)
    x = -np.cos(np.pi * (np.arange(count) + 0.5) / count)
    return np.asarray(np.exp(low + (high - low) * (x + 1) / 2) - NEAR)


def chebyshev(x: Array, most: int, differentiated: bool) -> Array:
    """Chebyshev polynomials up to a degree, or their derivatives, shape (places, most + 1)."""
    if not differentiated:
        return np.asarray(chebvander(x, most))
    # T_n' = n U_(n-1), with Chebyshev polynomials U of the second kind.
    second = np.ones((len(x), most + 1))
    if most > 0:
        second[:, 1] = 2 * x
    for n in range(2, most + 1):
        second[:, n] = 2 * x * second[:, n - 1] - second[:, n - 2]
    found = np.zeros_like(second)
    found[:, 1:] = second[:, :-1] * np.arange(1, most + 1)
    return found

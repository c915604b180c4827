"""How a pair moves along its master curve: where it is after a time, and at which distance its start is forgotten."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pairsim.record.columns import FROM_REST, STRETCH, T_RELAX, U
from pairsim.record.table import Table
from pairsim.runtime.arrays import Array
from pairsim.solvers.curves.interpolant import CurveInterpolant, hermite, slopes_of

FORGOTTEN = 3.0  # decay times after which a start is forgotten; chosen: exp(-3) = .05
STEPS = 400  # parts of the way for the integral; chosen
NODES = 512  # distances of a curve, between which rates of its motion are interpolated linearly; chosen
TINY = 1e-12  # stands for the slope of a rate that does not change; rounding

OfDistance = Callable[[Array | float], Array]


@dataclass(frozen=True)
class Motion:
    """How a pair moves at each distance."""

    curve: CurveInterpolant  # dU with its interval [U_av]
    velocity: OfDistance  # mean velocity of both particles [U_av]
    stretch: OfDistance  # derivative of the distance between the centres by that between the surfaces
    t_relax: OfDistance | None = None  # decay time of the slowest disturbance [D_c/U_av], None where it is not known
    from_rest: OfDistance | None = None  # bound on the shift of the centres by a start from rest there [D_c], if known

    @staticmethod
    def of(table: Table, curve: CurveInterpolant) -> Motion | None:
        """The motion of a pair, by its table and interpolant; None where the table does not tell how the pair moves."""
        leading, trailing, stretch = table.known(U, "_L"), table.known(U, "_T"), table.known(STRETCH)
        if leading is None or trailing is None or stretch is None:
            return None
        x = np.log(curve.d)
        smooth = (leading + trailing) / 2, stretch
        mean, centres = (hermite(x, values, slopes_of(values, x)) for values in smooth)
        times = table[T_RELAX]
        t_relax = (lambda d: np.interp(np.log(d), x, times)) if np.isfinite(times).all() else None
        shifts = table.known(FROM_REST)
        from_rest = None if shifts is None else (lambda d: np.interp(np.log(d), x, shifts))
        return Motion(curve, lambda d: mean(np.log(d)), lambda d: centres(np.log(d)), t_relax, from_rest)

    @cached_property
    def rates(self) -> tuple[Array, Array]:
        """Logarithms of distances of the curve, ascending, and their rates of change in time, shape (NODES,) each."""
        d = np.geomspace(self.curve.d[0], self.curve.d[-1], NODES)
        return np.log(d), self.curve.values(d) / self.stretch(d) / d

    def path(self, start: float, times: Array) -> Array:
        """Distances of the pair [D_c] at times [D_c/U_av], up to the ends of the curve, shape (times,).

        It is at `start` [D_c] at the time 0.
        """
        return path_by(*self.rates, start, times)

    def memory(self, start: float) -> Memory | None:
        """How the pair forgets a start at a distance [D_c]; None if decay times are not known."""
        if self.t_relax is None:
            return None
        curve = self.curve
        away = float(curve.values(start)) > 0
        way = np.geomspace(start, curve.ends[1] if away else curve.ends[0], STEPS)
        speed = curve.values(way) * (1 if away else -1)
        way, speed = (each[: STEPS if (speed > 0).all() else int(np.argmin(speed > 0))] for each in (way, speed))
        x = np.log(way)
        with np.errstate(divide="ignore"):
            rate = self.stretch(way) * way / speed / self.t_relax(way)
        steps = np.diff(x) * (rate[1:] + rate[:-1]) / 2  # scipy's running integral takes .3 s to import
        passed = np.abs(np.concatenate([[0.0], np.cumsum(steps)]))[: len(x)]
        return Memory(way, passed, len(way) == STEPS)


@dataclass(frozen=True)
class Memory:
    """How a pair forgets its start while it moves along a curve."""

    d: Array  # distances that it passes, from the start on [D_c], shape (n,)
    decays: Array  # decay times that have passed when it gets there, shape (n,)
    ends: bool  # whether it leaves the curve; else it comes to rest beyond the last distance

    @property
    def forgotten(self) -> float:
        """Distance from which the pair moves as the curve says, `FORGOTTEN` decay times after its start [D_c].

        Infinite if it leaves the curve before.
        """
        if len(self.d) and self.decays[-1] >= FORGOTTEN:
            return float(self.d[int(np.argmax(self.decays >= FORGOTTEN))])
        return np.inf if self.ends or not len(self.d) else float(self.d[-1])  # it comes to rest there


def path_by(x: Array, rate: Array, start: float, times: Array) -> Array:
    """Distances [D_c] at times [D_c/U_av] by the rates of their logarithms x, shape (times,); see `Motion.path`.

    Between two nodes, where rates are linear, the motion is an exponential function of time.
    """
    begin = np.log(start)
    first = np.interp(begin, x, rate)
    order = slice(None, None, 1 if first > 0 else -1)
    ahead = (x[order] - begin) * first > 0
    if not ahead.any():
        return np.full(times.shape, start)
    x, rate = np.append(begin, x[order][ahead]), np.append(first, rate[order][ahead])
    slope = np.diff(rate) / np.diff(x)
    slope[slope == 0] = TINY
    with np.errstate(all="ignore"):  # nan beyond a zero of the rate, which the pair never reaches
        passed = np.append(0.0, np.cumsum(np.log1p(np.diff(rate) / rate[:-1]) / slope))
        left = np.minimum(np.searchsorted(passed[1:], times, side="right"), len(slope) - 1)
        way = rate[left] * np.expm1(slope[left] * (times - passed[left])) / slope[left]
    return np.asarray(np.exp(np.clip(x[left] + way, *sorted(x[[0, -1]]))))

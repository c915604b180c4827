"""Flow rates that vary in time. This module does not import numpy, since checks of case files use it.

A time step, which is implicit, is driven by the flow at its end: at a jump `Waveform.at` therefore gives the value
before it, and steps begin and end where a waveform has a kink or jumps.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import asin, cos, floor, inf, isfinite, pi, sin, sqrt

SAME = 1e-12  # tolerance of times for rounding, relative to the larger of the time and 1
FLAT = 1e-12  # fraction of the largest flow below which a jump, or a change of slope times the cycle, is rounding


class Waveform(ABC):
    """A flow as a function of time, both in any units."""

    @property
    @abstractmethod
    def period(self) -> float | None:
        """Time after which it repeats; None if it does not."""

    @property
    @abstractmethod
    def cycle(self) -> float:
        """The period, or the time after which a flow that does not repeat is constant."""

    @abstractmethod
    def at(self, t: float) -> float:
        """The flow at a time from 0 on; at a jump, its value before the jump, but at 0 that after it."""

    @abstractmethod
    def after(self, t: float) -> float:
        """The flow right after a time."""

    @abstractmethod
    def slope(self, t: float) -> float:
        """Its rate of change at a time; at a kink, that before the kink."""

    @abstractmethod
    def slope_after(self, t: float) -> float:
        """Its rate of change right after a time."""

    @abstractmethod
    def next_kink(self, t: float) -> float:
        """The first time after t at which it jumps or has a kink; infinite if there is none."""

    @property
    def kinks(self) -> int:
        """Number of kinks and jumps in a cycle."""
        count, t = 0, 0.0
        while (t := self.next_kink(t)) <= self.cycle * (1 + SAME):
            count += 1
        return count

    @property
    @abstractmethod
    def mean(self) -> float:
        """Its mean over a cycle."""

    @property
    @abstractmethod
    def mean_size(self) -> float:
        """Mean of its absolute value over a cycle."""

    @property
    @abstractmethod
    def largest(self) -> float:
        """Its largest absolute value."""


@dataclass(frozen=True)
class Sine(Waveform):
    """offset + amplitude sin(2 pi t/duration)."""

    duration: float
    offset: float
    amplitude: float

    @property
    def period(self) -> float:
        return self.duration

    @property
    def cycle(self) -> float:
        return self.duration

    @property
    def _rate(self) -> float:
        return 2 * pi / self.period

    def at(self, t: float) -> float:
        return self.offset + self.amplitude * sin(self._rate * (t % self.period))

    def after(self, t: float) -> float:
        return self.at(t)

    def slope(self, t: float) -> float:
        return self.amplitude * self._rate * cos(self._rate * (t % self.period))

    def slope_after(self, t: float) -> float:
        return self.slope(t)

    def next_kink(self, t: float) -> float:
        return inf

    @property
    def mean(self) -> float:
        return self.offset

    @property
    def mean_size(self) -> float:
        m, a = abs(self.offset), abs(self.amplitude)
        return m if m >= a else 2 / pi * (m * asin(m / a) + sqrt(a**2 - m**2))

    @property
    def largest(self) -> float:
        return abs(self.offset) + abs(self.amplitude)


@dataclass(frozen=True)
class Polyline(Waveform):
    """A flow that is linear between some times, from 0 on; two equal times in a row make a jump.

    Attributes:
        times: The times, ascending from 0, at least two.
        flows: The flow at each of them.
        repeats: Whether it repeats after the last time; otherwise it keeps its last value.
    """

    times: tuple[float, ...]
    flows: tuple[float, ...]
    repeats: bool = False

    @property
    def period(self) -> float | None:
        return self.cycle if self.repeats else None

    @property
    def cycle(self) -> float:
        return self.times[-1]

    def _phase(self, t: float, *, later: bool) -> tuple[float, int]:
        """Time within the cycle, and index of the segment.

        At the end of a segment it is the index of this segment, or of the next one if `later`. Where the flow no longer
        changes it is the index of the last time.
        """
        little, cycles = SAME * max(1.0, t), 0
        t = max(t, 0.0)
        later = later or t <= little
        if self.repeats:
            cycles = floor((t + little if later else t - little) / self.cycle)
        phase = min(max(t - cycles * self.cycle, 0.0), inf)
        if not self.repeats and phase >= self.cycle + (-little if later else little):
            return phase, len(self.times) - 1
        if later:
            return phase, min(bisect_right(self.times, phase + little), len(self.times) - 1) - 1
        return phase, max(bisect_left(self.times, phase - little), 1) - 1

    def _flow(self, phase: float, i: int) -> float:
        if i == len(self.times) - 1:
            return self.flows[-1]
        share = (phase - self.times[i]) / (self.times[i + 1] - self.times[i])
        return self.flows[i] + min(max(share, 0.0), 1.0) * (self.flows[i + 1] - self.flows[i])

    def _slope(self, i: int) -> float:
        if i == len(self.times) - 1:
            return 0.0
        return (self.flows[i + 1] - self.flows[i]) / (self.times[i + 1] - self.times[i])

    def at(self, t: float) -> float:
        return self._flow(*self._phase(t, later=False))

    def after(self, t: float) -> float:
        return self._flow(*self._phase(t, later=True))

    def slope(self, t: float) -> float:
        return self._slope(self._phase(t, later=False)[1])

    def slope_after(self, t: float) -> float:
        return self._slope(self._phase(t, later=True)[1])

    def next_kink(self, t: float) -> float:
        little = SAME * max(1.0, t)
        first = floor(max(t - little, 0.0) / self.cycle) if self.repeats else 0
        for cycles in range(first, first + 3 if self.repeats and self._bent else 1):
            start = cycles * self.cycle
            if (i := bisect_right(self._bent, t + little - start)) < len(self._bent):
                return start + self._bent[i]
        return inf

    @cached_property
    def _bent(self) -> tuple[float, ...]:
        """Times of the kinks and jumps of the first cycle, its end included."""
        return tuple(t for t in dict.fromkeys(self.times) if t > 0 and self._bends(t))

    def _bends(self, t: float) -> bool:
        """Whether it jumps or has a kink at a time."""
        least = FLAT * self.largest
        turned = abs(self.slope_after(t) - self.slope(t)) * self.cycle
        return abs(self.after(t) - self.at(t)) > least or turned > least

    def _segments(self) -> Iterator[tuple[float, float, float, float]]:
        for (a, f), (b, g) in pairwise(zip(self.times, self.flows, strict=True)):
            if b > a:
                yield a, b, f, g

    @property
    def mean(self) -> float:
        return sum((b - a) * (f + g) / 2 for a, b, f, g in self._segments()) / self.cycle

    @property
    def mean_size(self) -> float:
        def area(a: float, b: float, f: float, g: float) -> float:
            crosses = f * g < 0
            return (b - a) / 2 * ((f * f + g * g) / (abs(f) + abs(g)) if crosses else abs(f) + abs(g))

        return sum(area(*each) for each in self._segments()) / self.cycle

    @cached_property
    def largest(self) -> float:
        return max(map(abs, self.flows))


def square(period: float, mean: float, amplitude: float) -> Polyline:
    """mean + amplitude in the first half of a period, mean - amplitude in the second one."""
    high, low, half = mean + amplitude, mean - amplitude, period / 2
    return Polyline((0.0, half, half, period), (high, high, low, low), repeats=True)


def triangle(period: float, mean: float, amplitude: float) -> Polyline:
    """From the mean up to mean + amplitude after a quarter of a period, down to mean - amplitude, and back."""
    high, low = mean + amplitude, mean - amplitude
    return Polyline((0.0, period / 4, 3 * period / 4, period), (mean, high, low, mean), repeats=True)


def ramp(period: float, mean: float, amplitude: float) -> Polyline:
    """From mean - amplitude to mean + amplitude within a period, then constant."""
    return Polyline((0.0, period), (mean - amplitude, mean + amplitude))


SHAPES = {"sine": Sine, "square": square, "triangle": triangle, "ramp": ramp}
"""Functions of period, mean and amplitude that make a waveform, by name."""


def table(times: Sequence[float], flows: Sequence[float]) -> Polyline:
    """The flow of a table, linear between its times; the first one is the time 0.

    Raises:
        ValueError: There are fewer than two times, or they do not ascend.
    """
    if len(times) != len(flows) or len(times) < 2:
        raise ValueError("must have at least two times, and a flow rate for each")
    if not all(map(isfinite, (*times, *flows))):
        raise ValueError("must have finite numbers")
    if any(b < a for a, b in pairwise(times)) or any(c <= a for a, c in zip(times, times[2:], strict=False)):
        raise ValueError("must have times that ascend (twice the same one for a jump)")
    if times[1] <= times[0] or times[-1] <= times[-2]:
        raise ValueError("must not begin or end with a jump")
    return Polyline(tuple(t - times[0] for t in times), tuple(flows))

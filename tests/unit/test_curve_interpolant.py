"""The interval of an interpolated curve holds the function, at its points and between them."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.points import made_point
from support.scenes import traced

from pairsim.physics.solids import soft
from pairsim.solvers.curves.curve import interpolants
from pairsim.solvers.curves.distances import WIDEST, between
from pairsim.solvers.curves.interpolant import CurveInterpolant
from pairsim.solvers.parameters import Parameters

Function = Callable[[np.ndarray], np.ndarray]
FINE = np.geomspace(0.02, 1.0, 2001)


def pulse(width: float) -> tuple[Function, Function]:
    """A peak at d = .2, as of soft pairs, and its derivative by d."""
    return (
        lambda d: np.exp(-((np.log(d / 0.2) / width) ** 2)),
        lambda d: -2 * np.log(d / 0.2) / width**2 / d * np.exp(-((np.log(d / 0.2) / width) ** 2)),
    )


SHAPES: dict[str, tuple[Function, Function]] = {
    "a peak": pulse(1.0),
    "a narrower peak": pulse(0.6),
    "two signs": (lambda d: np.log(d / 0.1) * np.exp(-3 * d), lambda d: (1 / d - 3 * np.log(d / 0.1)) * np.exp(-3 * d)),
    "a steep flank": (lambda d: np.tanh(4 * np.log(d / 0.15)), lambda d: 4 / d / np.cosh(4 * np.log(d / 0.15)) ** 2),
    "lubrication": (lambda d: d * np.log(1 / d), lambda d: np.log(1 / d) - 1),
}


def curve(f: Function, slope: Function, d: np.ndarray, error: float = 0.0) -> CurveInterpolant:
    return CurveInterpolant(d, f(d), f(d), slope(d), np.full(len(d), error))


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("asked", [2, 3, 5, 12])
def test_the_interval_of_a_curve_holds_the_function_between_its_points(name: str, asked: int) -> None:
    """Whatever was asked for: points are added until the interpolant is known to 1 % of the peak."""
    f, slope = SHAPES[name]
    fine: Any = SimpleNamespace(parameters=Parameters((1.0,), soft(0.0, 0.0)))
    stub: Any = SimpleNamespace(solver=fine, at=lambda at: made_point(at.gaps[0], f(at.gaps[0]), slope(at.gaps[0])))
    (found,) = interpolants(traced(stub, [(float(d),) for d in np.geomspace(1.0, 0.02, asked)], 1e-2, 200))
    off, peak = np.abs(found.values(FINE) - f(FINE)), np.abs(f(FINE)).max()
    assert (off <= found.half_widths(FINE) + 1e-12).mean() > 0.95
    assert off.max() < 1e-2 * peak
    assert len(found.d) <= 24


def test_the_interval_holds_a_peak_between_points_of_opposite_slopes() -> None:
    """The parabolas with either slope agree there, and tell nothing of the peak."""
    f, slope = pulse(0.7)
    found = curve(f, slope, 0.2 * np.exp(np.array([-1.5, -0.9, -0.3, 0.3, 0.9, 1.5])))
    off = abs(float(found.values(0.2)) - 1)
    assert 0.01 < off < float(found.half_widths(0.2))


def test_two_points_tell_nothing_of_what_lies_between() -> None:
    f, slope = pulse(1.0)
    found = curve(f, slope, np.array([0.05, 0.8]), 1e-3)
    assert np.isinf(found.half_widths(0.2))
    assert found.half_widths(np.array([0.05, 0.8])) == pytest.approx([1e-3, 1e-3])
    assert np.isinf(found.peak.error)


def test_the_part_without_exact_slopes_is_held_by_the_interval_too() -> None:
    """dU less dU_held is known at the points only."""
    d = np.geomspace(0.02, 1.0, 9)
    f, slope = pulse(1.0)

    def rest(d: np.ndarray) -> np.ndarray:
        return -0.05 * np.exp(-((np.log(d / 0.02) / 1.2) ** 2))

    found = CurveInterpolant(d, f(d) + rest(d), f(d), slope(d), np.zeros(9))
    off = np.abs(found.values(FINE) - f(FINE) - rest(FINE))
    assert (off <= found.half_widths(FINE) + 1e-12).mean() > 0.97
    assert off.max() < 2e-3


def test_errors_fall_with_the_distance_of_the_points() -> None:
    f, slope = pulse(1.0)
    errors = [curve(f, slope, np.geomspace(0.02, 1.0, count)).errors.max() for count in (9, 17, 33)]
    assert errors[0] / errors[1] > 5.5
    assert errors[1] / errors[2] > 5.5


def test_height_and_place_of_a_peak_lie_in_their_intervals() -> None:
    f, slope = pulse(0.8)
    for count in (5, 6, 7, 8, 12):
        peak = curve(lambda d: -f(d), lambda d: -slope(d), np.geomspace(0.02, 1.0, count), 0.01).peak
        assert abs(peak.dU + 1) < peak.error
        assert abs(peak.d - 0.2) < peak.d_error
    sharp = curve(f, slope, np.geomspace(0.02, 1.0, 33)).peak
    assert sharp.d == pytest.approx(0.2, rel=0.02)
    assert sharp.error < 1e-3


def test_neighbours_are_close_enough_for_something_to_be_said_of_what_lies_between() -> None:
    filled = [d for (d,) in between([(1.0,), (0.04,)], 100)]
    assert filled[0] == 1.0
    assert filled[-1] == 0.04
    ratios = np.array(filled[:-1]) / filled[1:]
    assert ratios == pytest.approx(np.full(len(ratios), ratios[0]))
    assert ratios[0] <= WIDEST < ratios[0] ** (len(ratios) / (len(ratios) - 1))
    assert between([(0.3, 0.3), (0.1, 0.1)], 100) == [(0.3, 0.3), pytest.approx((0.03**0.5,) * 2), (0.1, 0.1)]
    assert between([(1.0,), (0.04,)], 2) == [(1.0,), (0.04,)]
    assert between([], 5) == []

"""Points of a curve and its zeros, on branches without cells whose dU is a formula."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from support.points import made_point
from support.scenes import traced

from pairsim.physics.solids import soft
from pairsim.runtime.errors import BranchEnd, NoSteadyState
from pairsim.solvers.curves.critical import same_zero
from pairsim.solvers.curves.curve import Equilibrium, equilibria, find_zeros, interpolants, trace
from pairsim.solvers.curves.distances import WIDEST, between
from pairsim.solvers.curves.interpolant import CurveInterpolant, hermite
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import Ended, arrived


class Analytic:
    """A branch without cells: dU_i and their slopes are given functions of log d."""

    def __init__(self, values: Callable[[float], list[float]], slopes: Callable[[float], list[float]]) -> None:
        self.values, self.slopes, self.solved = values, slopes, 0
        self.solver = SimpleNamespace(parameters=Parameters((0.8, 0.8), soft(0.0, 0.0, 0.0)))

    def at(self, parameters: Parameters) -> Any:
        self.solved += 1
        x = float(np.log(parameters.gaps[0]))
        return made_point(parameters.gaps[0], self.values(x), np.array(self.slopes(x)) / parameters.gaps[0])


def added_to(asked: int, at: Callable[[Parameters], Any], tol: float, widest: float = 0.8) -> list[Any]:
    """The points of a pair between d = .02 and the widest distance, of which so many were asked for."""
    solver = SimpleNamespace(parameters=Parameters((widest,), soft(0.1, 0.1)))
    stub: Any = SimpleNamespace(solver=solver, at=at)
    return traced(stub, [(float(d),) for d in np.geomspace(widest, 0.02, asked)], tol, 200)


@pytest.mark.parametrize("gap", [0, 1])
def test_points_are_added_where_any_gap_of_three_particles_asks_for_them(gap: int) -> None:
    def mixed(bending: float, straight: float) -> list[float]:
        return [bending, straight] if gap == 0 else [straight, bending]

    places = [(d, d) for d in np.geomspace(0.8, 0.02, 9)]
    straight: Any = Analytic(lambda x: [1 + x, 2 - x], lambda x: [1, -1])
    traced(straight, places, 2e-3, 100)
    assert straight.solved == 9, "lines need none"
    bending: Any = Analytic(
        lambda x: mixed(np.tanh(2 * x + 4.5), x / 9), lambda x: mixed(2 / np.cosh(2 * x + 4.5) ** 2, 1 / 9)
    )
    curve = interpolants(traced(bending, places, 2e-3, 100))[gap]
    d = np.geomspace(0.02, 0.8, 500)
    assert np.abs(curve.values(d) - np.tanh(2 * np.log(d) + 4.5)).max() < 2e-3


def test_no_point_is_added_for_the_noise_of_meshes() -> None:
    """dU and slopes of different meshes differ by less than their errors: that is no bend of the curve."""
    noise = np.random.default_rng(1)

    def at(parameters: Parameters) -> Any:
        d = parameters.gaps[0]
        rough = noise.uniform(-1e-2, 1e-2, 2)
        return made_point(d, 1 + 0.1 * np.log(d) + rough[0], (0.1 + rough[1]) / d, error=2e-2)

    assert len(added_to(9, at, 2e-3)) == 9


@pytest.mark.parametrize("part", [0.2, 0.45, 2.0])
@pytest.mark.parametrize("tol", [2e-3, 1e-2, 2e-2])
def test_points_are_added_until_the_half_width_between_them_is_small(part: float, tol: float) -> None:
    """It is that of the points and of the interpolation together: `tol` of the largest |dU|, or twice the points'."""

    def at(parameters: Parameters) -> Any:
        x = float(np.log(parameters.gaps[0]))
        slope = 2 / np.cosh(2 * x + 4.5) ** 2
        return made_point(parameters.gaps[0], np.tanh(2 * x + 4.5), slope / parameters.gaps[0], error=part * tol)

    (curve,) = interpolants(added_to(8, at, tol))
    assert curve.half_widths(np.sqrt(curve.d[1:] * curve.d[:-1])).max() <= max(1.0, 2 * part) * tol


def test_a_jump_between_meshes_is_not_chased() -> None:
    """At a jump larger than the errors tell, points are added down to a tenth of the distance, not beyond."""

    def at(parameters: Parameters) -> Any:
        d = parameters.gaps[0]
        return made_point(d, 1.0 + (d > 0.1), 0.0, error=1e-6)

    assert len(added_to(9, at, 2e-3)) < 30


def test_distances_that_were_asked_for_are_marked_and_never_left_out() -> None:
    branch: Any = Analytic(lambda x: [x], lambda x: [1])
    branch.solver.parameters = Parameters((0.8,), soft(0.0, 0.0))
    marked = list(trace(branch, [(0.8,), (0.05,), (0.04,)], 1e-2, 2))
    assert [(point.d, wanted) for point, wanted in marked] == [(0.8, True), (0.05, True), (0.04, True)]
    marked = list(trace(branch, [(0.8,), (0.05,), (0.04,)], 1e-2, 100))
    assert [point.d for point, wanted in marked if wanted] == [0.8, 0.05, 0.04]
    d = np.sort([point.d for point, _ in marked])
    assert (d[1:] / d[:-1]).max() <= WIDEST


def test_the_end_of_a_branch_is_the_last_of_its_points() -> None:
    """It is a value, not a failure: the points before it are there, and none is looked for beyond."""
    end = Ended(BranchEnd("no steady states beyond"))

    class Ending(Analytic):
        def at(self, parameters: Parameters) -> Any:
            return end if parameters.gaps[0] < 0.1 else super().at(parameters)

    branch: Any = Ending(lambda x: [x], lambda x: [1])
    branch.solver.parameters = Parameters((0.8,), soft(0.0, 0.0))
    *points, last = trace(branch, [(0.8,), (0.4,), (0.05,), (0.04,)], 1e-2, 4)
    assert [point.d for point, _ in points] == [0.8, 0.4]
    assert last is end
    with pytest.raises(BranchEnd, match="beyond"):
        arrived(last)


def test_a_zero_within_the_mesh_error_is_called_uncertain() -> None:
    zero: Any = SimpleNamespace(point=made_point(0.2, 0.0, 1.0, 0.002), d=0.2)
    (clear,) = equilibria([zero], [made_point(0.1, -0.1, 1.0, 0.01), made_point(0.3, 0.1, 1.0, 0.01)])
    (vague,) = equilibria([zero], [made_point(0.1, -0.005, 1.0, 0.01), made_point(0.3, 0.1, 1.0, 0.01)])
    assert clear.certain
    assert clear.d_error == pytest.approx(0.002)
    assert not vague.certain


def test_the_peak_beside_a_zero_is_part_of_the_largest_dU_between_points_too() -> None:
    zero: Any = SimpleNamespace(point=made_point(0.2, 0.0, 1.0), d=0.2)
    (found,) = equilibria([zero], [made_point(0.1, -0.05, 1.0), made_point(0.3, 0.1, 2.0), made_point(0.4, 0.1, -2.0)])
    assert found.peak == 1.0, "dU rises to more than .1 between .3 and .4"


def zeros_without_newton(at: Callable[[float], Any], *places: float) -> list[Equilibrium]:
    """The zeros of a curve on which Newton's method finds none."""

    def refuse(*_: float, **__: bool) -> Any:
        raise NoSteadyState("no")

    solver = SimpleNamespace(snapshot=None)
    stub: Any = SimpleNamespace(zero=refuse, at=lambda parameters: at(parameters.gaps[0]), solver=solver)
    points = [at(d) for d in places]
    return equilibria(list(find_zeros(stub, points)), points)


def test_a_zero_that_newton_misses_between_smooth_points_is_found() -> None:
    (zero,) = zeros_without_newton(lambda d: made_point(d, d - 0.2, 1.0), 0.1, 0.3)
    assert zero.d == pytest.approx(0.2, rel=1e-4)


def test_the_slope_beside_a_zero_tells_where_it_is() -> None:
    """dU = d - .2 is known at d = .203, within its half-width of 0: no solution is needed at .2."""
    beside = made_point(0.203, 0.003, 1.0, 0.005)
    stub: Any = SimpleNamespace(zero=lambda *_, **__: beside, solver=SimpleNamespace(snapshot=None))
    points = [made_point(d, d - 0.2, 1.0, 0.005) for d in (0.1, 0.3)]
    (zero,) = equilibria(list(find_zeros(stub, points)), points)
    assert zero.d == pytest.approx(0.2, rel=1e-9)
    assert zero.d_error == pytest.approx(0.005)


@pytest.mark.parametrize("error", [0.002, 0.02, 0.04])
@pytest.mark.parametrize("slope", [-1.0, 0.01])
def test_a_zero_at_a_jump_between_two_meshes_is_listed_with_its_interval(error: float, slope: float) -> None:
    """dU falls from a certain sign to one that is certain, or is not, by a jump at d = .21: the zero is near."""
    (zero,) = zeros_without_newton(lambda d: made_point(d, 0.2 - d + 0.01 * (d < 0.21), slope, error), 0.1, 0.23)
    assert zero.stable
    assert abs(zero.d - 0.205) <= max(zero.d_error, 0.01)
    assert zero.d_error >= error / max(abs(slope), abs(zero.slope)) > 0
    assert zero.certain == (error < 0.03)


def test_a_change_of_sign_between_two_uncertain_points_is_no_zero() -> None:
    assert zeros_without_newton(lambda d: made_point(d, 0.2 - d + 0.01 * (d < 0.21), -1.0, 0.2), 0.1, 0.23) == []


def test_zeros_of_one_slope_that_lie_close_are_one_zero() -> None:
    def zero(d: float, slope: float) -> Any:
        return SimpleNamespace(d=d, slopes=np.array([slope]), parameters=Parameters((d,), soft(0.1, 0.1)))

    assert same_zero(zero(0.077, 1.0), zero(0.080, 2.0))
    assert not same_zero(zero(0.077, 1.0), zero(0.080, -1.0))
    assert not same_zero(zero(0.077, 1.0), zero(0.100, 1.0))


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

    def at(place: Parameters) -> Any:
        return made_point(place.gaps[0], f(place.gaps[0]), slope(place.gaps[0]))

    (found,) = interpolants(added_to(asked, at, 1e-2, widest=1.0))
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


@pytest.mark.parametrize("n", [2, 3, 12])
def test_piecewise_cubics_and_their_zeros_are_those_of_scipy(n: int) -> None:
    rng = np.random.default_rng(n)
    x, values, slopes = np.sort(rng.random(n)), rng.standard_normal(n), rng.standard_normal(n)
    at, known = np.linspace(x[0], x[-1], 50), CubicHermiteSpline(x, values, slopes)
    assert hermite(x, values, slopes)(at) == pytest.approx(known(at), abs=1e-12)
    found = CurveInterpolant(np.exp(x), values, values, slopes / np.exp(x), np.zeros(n)).zeros
    assert np.log(found) == pytest.approx(known.roots(extrapolate=False), abs=1e-12)


def test_a_zero_at_a_point_is_found_once() -> None:
    x = np.array([0.0, 1.0, 2.0])
    found = CurveInterpolant(np.exp(x), x - 1, x - 1, np.exp(-x), np.zeros(3)).zeros
    assert found == pytest.approx([np.e])

"""Points of a curve and its zeros, on branches without cells whose dU is a formula."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.scenes import traced

from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.critical import same_zero
from pairsim.solvers.curve import Zero, equilibria, find_zeros, interpolant
from pairsim.solvers.parameters import Parameters


class Analytic:
    """A branch without cells: dU_i and their slopes are given functions of log d."""

    def __init__(self, values: Callable[[float], list[float]], slopes: Callable[[float], list[float]]) -> None:
        self.values, self.slopes, self.solved = values, slopes, 0
        self.fine = SimpleNamespace(parameters=Parameters((0.8, 0.8), (0.0, 0.0, 0.0)))

    def at(self, parameters: Parameters) -> Any:
        self.solved += 1
        d, x = parameters.gaps[0], float(np.log(parameters.gaps[0]))
        dUs, slopes = np.array(self.values(x)), np.array(self.slopes(x)) / d
        return SimpleNamespace(d=d, dU=dUs.sum(), dUs=dUs, slopes=slopes, dU_errors=0 * dUs, parameters=parameters)


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
    curve = interpolant(traced(bending, places, 2e-3, 100))
    x = np.linspace(np.log(0.02), np.log(0.8), 500)
    assert np.abs(curve(x)[:, gap] - np.tanh(2 * x + 4.5)).max() < 2e-3


def test_a_zero_within_the_mesh_error_is_called_uncertain() -> None:
    def point(d: float, dU: float, error: float) -> Any:
        return SimpleNamespace(
            d=d, dU=dU, dUs=np.array([dU]), slopes=np.array([1.0]), slope_at_rest=1.0, dU_errors=np.array([error])
        )

    zero: Any = SimpleNamespace(point=point(0.2, 0.0, 0.002))
    (clear,) = equilibria([zero], [point(0.1, -0.1, 0.01), point(0.3, 0.1, 0.01)])
    (vague,) = equilibria([zero], [point(0.1, -0.005, 0.01), point(0.3, 0.1, 0.01)])
    assert clear.certain
    assert clear.d_error == pytest.approx(0.002)
    assert not vague.certain


def test_the_peak_beside_a_zero_is_part_of_the_largest_dU_between_points_too() -> None:
    def point(d: float, dU: float, slope: float) -> Any:
        return SimpleNamespace(
            d=d, dU=dU, dUs=np.array([dU]), slopes=np.array([slope]), slope_at_rest=slope, dU_errors=np.zeros(1)
        )

    zero: Any = SimpleNamespace(point=point(0.2, 0.0, 1.0))
    (found,) = equilibria([zero], [point(0.1, -0.05, 1.0), point(0.3, 0.1, 2.0), point(0.4, 0.1, -2.0)])
    assert found.peak == 1.0, "dU rises to more than .1 between .3 and .4"


def test_a_zero_that_newton_misses_between_smooth_points_is_no_jump() -> None:
    def point(d: float) -> Any:
        keys = {"slopes": np.array([1.0]), "parameters": Parameters((d,), (0.1, 0.1))}
        return SimpleNamespace(d=d, dU=d - 0.2, dUs=np.array([d - 0.2]), **keys)

    def refuse(*_: float) -> Any:
        raise NoSteadyState("no")

    stub: Any = SimpleNamespace(zero=refuse, at=lambda parameters: point(parameters.gaps[0]), snapshots=())
    (zero,) = find_zeros(stub, [point(0.1), point(0.3)])
    assert isinstance(zero, Zero)
    assert zero.point.d == pytest.approx(0.2, rel=1e-4)


def test_zeros_of_one_slope_that_lie_close_are_one_zero() -> None:
    def zero(d: float, slope: float) -> Any:
        return SimpleNamespace(d=d, slopes=np.array([slope]), parameters=Parameters((d,), (0.1, 0.1), 0.25))

    assert same_zero(zero(0.077, 1.0), zero(0.080, 2.0))
    assert not same_zero(zero(0.077, 1.0), zero(0.080, -1.0))
    assert not same_zero(zero(0.077, 1.0), zero(0.100, 1.0))

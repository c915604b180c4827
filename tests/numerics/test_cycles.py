"""Cycles of a flow that varies: what is added up in them, when they are periodic, and errors over a jump."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pairsim.solvers.errors.time_error import TimeError
from pairsim.solvers.transient.cycles import Cycles


def cycles_of(dU: Callable[[float], float], count: int, *, memory: float = 0.0, error: float = 0.0) -> Cycles:
    """Cycles of length 2 of a pair at a held distance with a relative velocity over time, in 64 steps each."""
    cycles, times = Cycles(2.0, True, True, memory, np.array([0.2])), np.linspace(0, 2 * count, 64 * count + 1)
    for t in times[1:]:
        cycles.add(float(t), np.array([0.2]), np.array([dU(float(t))]), 0.0, error)
    return cycles


def test_the_drift_is_the_integral_of_dU_over_a_cycle_and_the_half_width_that_of_its_error() -> None:
    cycles = cycles_of(lambda t: 0.01 + np.sin(np.pi * t), 3, error=1e-3)
    assert cycles.count == 3
    assert cycles.drift == pytest.approx([0.02], abs=1e-5)
    assert cycles.error == pytest.approx([2e-3])
    assert cycles.peak == pytest.approx(1.01, rel=1e-3)


def test_of_a_pair_that_moves_it_is_the_change_of_its_distance_with_the_estimated_error() -> None:
    cycles = Cycles(2.0, True, False, 0.0, np.array([0.2]))
    for t in np.linspace(0, 2, 33)[1:]:
        cycles.add(float(t), np.array([0.2 + 0.1 * t]), np.array([0.13]), np.array([0.03]), 0.0)
    assert cycles.drift == pytest.approx([0.2 + 0.06])


def test_cycles_are_periodic_once_they_are_alike_and_what_memory_adds_has_faded() -> None:
    def fading(t: float) -> float:
        return float(np.sin(np.pi * t) + 0.5 * np.exp(-t / 10))

    assert not cycles_of(np.sin, 1).are_periodic(0.5)
    assert cycles_of(lambda t: np.sin(np.pi * t), 3, memory=10.0).are_periodic(1e-3)
    assert not cycles_of(fading, 3, memory=10.0).are_periodic(0.05)
    late = cycles_of(fading, 15, memory=10.0)
    assert late.are_periodic(0.05)
    left = 0.5 * np.exp(-30 / 10)  # which the cycles to come still differ by, at most
    assert left / 2 < late.remaining < 2 * left


def test_the_drift_is_known_when_its_half_width_is_small_too() -> None:
    assert cycles_of(lambda t: np.sin(np.pi * t), 2, error=5e-3).are_known(0.01)
    assert not cycles_of(lambda t: np.sin(np.pi * t), 2, error=2e-2).are_known(0.01)


def test_a_jump_of_dU_at_a_kink_is_no_error_of_the_time_steps() -> None:
    def largest(*, again: bool) -> float:
        error = TimeError(order=3)
        for t in np.linspace(0.1, 1.0, 10):
            error.add(t, 0, [1.0 if t < 0.55 else -1.0])
            if again and t == pytest.approx(0.5):
                error.begin_again(t)
        return error.largest

    assert largest(again=False) > 0.1
    assert largest(again=True) == 0.0

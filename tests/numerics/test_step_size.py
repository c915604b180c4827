"""The time scheme on its own: order, error estimate, landing."""

from __future__ import annotations

import pytest

from pairsim.solvers.stepping.step_size import GROWTH, Scheme, StepControl, extrapolation_weights, land, velocity_error


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_bdf_is_exact_for_polynomials_of_its_order(order: int, ratio: float) -> None:
    old = [1.0, 0.9, 0.75][:order]
    new = 1.0 + 0.1 * ratio
    scheme = Scheme.bdf(old, new)
    for power in range(order + 1):
        h_star = sum(w * t**power for w, t in zip(scheme.weights, old, strict=True))
        assert h_star + scheme.g * power * new ** (power - 1) == pytest.approx(new**power, rel=1e-13)


def test_steps_that_grow_as_fast_as_they_may_do_not_amplify() -> None:
    """What a jump of an old value becomes when nothing moves: it must settle, not grow."""
    t, h, dt = [0.2, 0.1, 0.0], [1.0, 0.0, 0.0], 0.1
    for _ in range(60):
        dt *= GROWTH
        new = t[0] + dt
        t, h = [new, *t[:2]], [sum(w * x for w, x in zip(Scheme.bdf(t, new).weights, h, strict=True)), *h[:2]]
    assert abs(h[0] - h[1]) < 0.01
    assert abs(h[0]) < 10


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.5])
def test_error_estimate_is_exact_for_cubics(ratio: float) -> None:
    """(Corrected - predicted) value times the factor is what BDF2 leaves in the derivative of t^3."""
    old = [1.0, 0.9, 0.75]
    new = 1.0 + 0.1 * ratio
    bdf2 = Scheme.bdf(old[:2], new)
    derivative = (new**3 - sum(w * t**3 for w, t in zip(bdf2.weights, old[:2], strict=True))) / bdf2.g
    predicted = sum(w * t**3 for w, t in zip(extrapolation_weights(old, new), old, strict=True))
    assert velocity_error(old, new) * (new**3 - predicted) == pytest.approx(3 * new**2 - derivative, rel=1e-10)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_extrapolation_is_exact_for_polynomials_through_all_values(count: int) -> None:
    old = [1.0, 0.9, 0.75][:count]
    weights = extrapolation_weights(old, 1.1)
    for power in range(count):
        predicted = sum(w * t**power for w, t in zip(weights, old, strict=True))
        assert predicted == pytest.approx(1.1**power, rel=1e-13)


def test_steps_land_without_a_last_tiny_one() -> None:
    assert land(0.0, 0.1, 0.05) == 0.05
    assert land(0.0, 0.1, 0.15) == 0.075
    assert land(0.0, 0.1, 1.0) == 0.1


def test_frequent_outputs_do_not_hold_the_step_down() -> None:
    control = StepControl(1e-4, 1e-8, 1.0)
    assert control.next(0.1, 0.05, 0.01) == pytest.approx(0.1 * GROWTH)
    assert control.next(0.1, 0.05, 0.9) == pytest.approx(0.1)
    assert control.next(0.1, 0.1, 1.4) < 0.1
    assert control.next(1.0, 1.0, 1e-6) == 1.0

"""The time scheme on its own: order, error estimate, landing."""

from __future__ import annotations

import numpy as np
import pytest

from pairsim.stepsize import Scheme, StepControl, error_factor, extrapolation_weights, land


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.7])
def test_bdf2_is_exact_for_parabolas(ratio: float) -> None:
    t = np.array([1.0, 0.9])
    new = 1.0 + 0.1 * ratio
    scheme = Scheme.bdf(new - t[0], t[0] - t[1])
    h_star = sum(w * value for w, value in zip(scheme.weights, t**2 + t, strict=True))
    assert h_star + scheme.g * (2 * new + 1) == pytest.approx(new**2 + new, rel=1e-14)


def test_first_step_is_exact_for_lines() -> None:
    scheme = Scheme.bdf(0.1, None)
    assert scheme.weights[0] * 3.0 + scheme.g * 2.0 == pytest.approx(3.2)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.7])
def test_error_estimate_is_exact_for_cubics(ratio: float) -> None:
    """With the exact derivative of t^3, corrected minus predicted times the factor is the error of the BDF2 step."""
    old = [1.0, 0.9, 0.75]
    new = 1.0 + 0.1 * ratio
    scheme = Scheme.bdf(new - old[0], old[0] - old[1])
    corrected = sum(w * t**3 for w, t in zip(scheme.weights, old, strict=False)) + scheme.g * 3 * new**2
    predicted = sum(w * t**3 for w, t in zip(extrapolation_weights(old, new), old, strict=True))
    # The derivative is taken at the new time, so the implicit equation carries the factor of its own error.
    assert error_factor(old, new) * (corrected - predicted) == pytest.approx(corrected - new**3, rel=1e-10)


def test_steps_land_without_a_last_tiny_one() -> None:
    assert land(0.0, 0.1, 0.05) == 0.05
    assert land(0.0, 0.1, 0.15) == 0.075
    assert land(0.0, 0.1, 1.0) == 0.1


def test_frequent_outputs_do_not_hold_the_step_down() -> None:
    control = StepControl(1e-4, 1e-8, 1.0)
    assert control.next(0.1, 0.05, 0.01) == pytest.approx(0.16)
    assert control.next(0.1, 0.05, 0.9) == pytest.approx(0.1)
    assert control.next(0.1, 0.1, 1.4) < 0.1
    assert control.next(1.0, 1.0, 1e-6) == 1.0


def test_a_fixed_step_is_kept_whatever_the_error() -> None:
    control = StepControl(1e-4, 1e-8, 1.0, fixed=0.01)
    assert control.accepts(1e9)
    assert control.next(0.01, 0.01, 1e9) == 0.01

"""The error that is quoted with dU in a run: its four terms."""

from __future__ import annotations

import numpy as np
import pytest

from pairsim.solvers.errors.run_errors import Interval


def quoted(t: np.ndarray, dU: np.ndarray, correction: np.ndarray, steps: float = 0.0, De: float = 0.0) -> np.ndarray:
    """The errors of a run that is remeshed after t = 0.5."""
    error = Interval(memory=1.0 + De)
    rows = zip(t.tolist(), dU, correction, strict=True)
    return np.array([error.add(t, int(t > 0.5), np.array([u]), np.array([c]), steps)[0] for t, u, c in rows])


T = np.linspace(0.1, 2.0, 39)


def test_estimate_counts_twice_and_the_error_of_the_steps_is_added() -> None:
    growing = -1e-3 * T
    assert quoted(T, T**2 - growing, growing, 1e-4) == pytest.approx(2e-3 * T + 1e-4, rel=1e-9)


@pytest.mark.parametrize("De", [0.0, 2.0])
def test_largest_estimate_so_far_is_forgotten_in_a_time_of_one_and_De(De: float) -> None:
    """Where the estimate changes its sign, the interval does not vanish."""
    once = np.where(T < 0.3, 1e-3, 0.0)
    last = T[once > 0][-1]
    later = quoted(T, -once, once, De=De)[once == 0]
    assert later == pytest.approx(1e-3 * np.exp(-(T[once == 0] - last) / (1 + De)), rel=1e-9)


def test_jumps_at_remeshings_count_unless_the_estimate_has_them() -> None:
    """A change of the mesh's own error is in the estimate; what it leaves of the jump is an error."""
    jump = np.where(T > 0.5, 2e-3, 0.0)
    after = T > 0.5
    explained = quoted(T, T**2 + jump, -jump)
    assert explained[~after] == pytest.approx(0.0)
    assert explained[after][0] == pytest.approx(4e-3)
    lost = quoted(T, T**2 + jump, 0 * T)
    assert lost[~after] == pytest.approx(0.0)
    assert lost[after] == pytest.approx(2e-3 * np.exp(-(T[after] - T[after][0])), rel=1e-6)


def test_error_of_the_start_is_forgotten_and_its_first_estimates_do_not_count() -> None:
    """Before SET_IN soft shapes take up the stress that the error equation begins without."""
    error, t = Interval(memory=1.0), np.array([1e-3, 0.5, 1.0])
    error.start = np.array([1e-4])
    found = [error.add(float(at), 0, np.zeros(1), np.array([1e-3 * (at < 0.1)]), 0.0)[0] for at in t]
    assert found == pytest.approx([1e-3 + 1e-4 * np.exp(-t[0]), *1e-4 * np.exp(-t[1:])], rel=1e-9)


def test_intervals_widen_where_cells_do_not_resolve_the_stress() -> None:
    """A change of log c of 2.2 within a cell is twice what was resolved: the estimate counts eight times."""
    found = [
        Interval(memory=3.0).add(1.0, 0, np.zeros(1), np.array([1e-5]), 1e-6, s_jump)[0] for s_jump in (0.5, 1.1, 2.2)
    ]
    assert found == pytest.approx([2.1e-5, 2.1e-5, 1.61e-4])

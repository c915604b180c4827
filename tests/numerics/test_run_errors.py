"""The error that is quoted with dU in a run: its four terms, that of the time steps, and the warnings of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pairsim.computing.case_files import parse_case
from pairsim.questions.registry import QUESTIONS
from pairsim.questions.run.warnings import long_steps, warnings_of_run
from pairsim.solvers.errors.run_errors import OF_POINTS, Interval, RunErrors, widening
from pairsim.solvers.errors.time_error import SAFETY, TimeError
from pairsim.solvers.goals import D_OF_EACH, DP_PLUS_IN_TIME, IN_TIME, U, dU
from pairsim.solvers.stepping.step_size import Scheme
from pairsim.solvers.transient.state import Extremes


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


def test_error_of_the_start_does_not_fade_and_its_first_estimates_do_not_count() -> None:
    """Before SET_IN soft shapes take up the stress that the error equation begins without; then the larger counts."""
    error, t, estimates = Interval(memory=1.0), (1e-3, 0.5, 1.0, 1.5), (1e-3, 0.0, 3e-4, 0.0)
    error.start = np.array([1e-4])
    rows = zip(t, estimates, strict=True)
    found = [error.add(at, 0, np.zeros(1), np.array([each]), 0.0)[0] for at, each in rows]
    assert found == pytest.approx([1.1e-3, 1e-4, 6e-4, 3e-4 * np.exp(-0.5)], rel=1e-9)
    assert error.add(2.0, 0, np.zeros(1), np.zeros(1), 0.0, closer=2.0) == pytest.approx(4e-4)


def test_error_of_the_settled_state_sets_in_with_the_stress_of_a_run_from_rest() -> None:
    """What the cells leave of the stress is as small as the stress: a first time of 0.01 is not refined for it."""
    error = Interval(memory=1.5, start=np.array([1e-4]), setting_in=0.5)
    found = [error.add(t, 0, np.zeros(1), np.zeros(1), 0.0)[0] for t in (0.01, 0.5, 5.0)]
    assert found == pytest.approx([1.98e-6, 6.32e-5, 1e-4], rel=1e-3)


def test_an_estimate_that_is_not_added_counts_once_more() -> None:
    """dU and velocities of a run contain theirs, shapes and the pressure drop do not."""
    errors = RunErrors.of(parse_case(QUESTIONS["run"], KEYS, "").liquid_model)
    values, estimates = ({goal: np.array([value]) for goal in IN_TIME} for value in (1.0, 1e-3))
    found = errors.add(1.0, 0, values, estimates, 0.0)
    assert {goal: float(error[0] / 1e-3) for goal, error in found.items()} == pytest.approx(
        {dU: 2, U: 2, D_OF_EACH: 3, DP_PLUS_IN_TIME: 3}
    )


def test_what_errors_do_to_a_viscosity_adds_up_in_what_a_run_integrates() -> None:
    """Velocities follow the flow of the moment; shapes keep what each step leaves, as long as they are remembered."""
    errors = RunErrors.of(parse_case(QUESTIONS["run"], KEYS, "").liquid_model)
    nothing = {goal: np.zeros(1) for goal in IN_TIME}
    for t in (0.1, 0.2):
        found = errors.add(t, 0, nothing, nothing, 0.0, irregular={goal: np.array([1e-4]) for goal in IN_TIME})
    assert found[dU] == pytest.approx(1e-4)
    assert found[D_OF_EACH] == pytest.approx(1e-4 * (1 + np.exp(-0.1)))


def test_intervals_widen_where_cells_do_not_resolve_the_stress() -> None:
    """A change of log c of 2.2 within a cell is twice what was resolved: the estimate counts eight times."""
    found = [
        Interval(memory=3.0).add(1.0, 0, np.zeros(1), np.array([1e-5]), 1e-6, s_jump)[0] for s_jump in (0.5, 1.1, 2.2)
    ]
    assert found == pytest.approx([2.1e-5, 2.1e-5, 1.61e-4])


def test_intervals_of_quasi_steady_solutions_widen_with_the_square() -> None:
    """What the error of a soft pair in FENE-P on adapted cells asks for: 3.3 intervals where log c changes by 2.4."""
    assert [widening(s_jump, OF_POINTS) for s_jump in (0.0, 1.1, 2.2)] == pytest.approx([1, 1, 4])
    assert widening(2.42, OF_POINTS) > 3.32


KEYS: dict[str, Any] = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "ends": "developed", "length": "auto"}
ORDER = 3


def estimate(t: np.ndarray, dU: np.ndarray, order: int = ORDER, mesh: np.ndarray | None = None) -> float:
    """The estimated error itself, where the largest |dU| is one."""
    error = TimeError(order)
    for row in zip(t.tolist(), np.zeros(len(t)) if mesh is None else mesh, dU, strict=True):
        error.add(row[0], int(row[1]), [row[2]])
    return error.part


@pytest.mark.parametrize("order", [2, 3])
def test_estimate_is_what_bdf_leaves_of_a_polynomial(order: int) -> None:
    """Of the derivative of t^(order + 1), in steps that vary; the first three are too early to count."""
    t = np.array([0.001, 0.002, 0.003, 0.1, 0.2, 0.35, 0.5, 1.0])

    def left(k: int) -> float:
        old = t[k - order : k][::-1]
        scheme = Scheme.bdf(old.tolist(), t[k])
        h_star = sum(w * time ** (order + 1) for w, time in zip(scheme.weights, old, strict=True))
        return float(abs((t[k] ** (order + 1) - h_star) / scheme.g - (order + 1) * t[k] ** order))

    largest = max(left(k) for k in range(3, len(t)))
    assert estimate(t, t**order, order) == pytest.approx(SAFETY * largest / (order + 1), rel=1e-9)


@pytest.mark.parametrize(("power", "longest", "factor"), [(1, 0, 3), (3, 2, 3), (3, 3, 1)])
def test_errors_of_the_first_three_steps_count_three_times(power: int, longest: int, factor: float) -> None:
    """Orders rise with the steps; t^k has the derivatives that count, and one step is much longer than all others."""
    t = np.cumsum(np.where(np.arange(4) == longest, 0.48, 0.01))
    order = min(longest + 1, ORDER)
    old = np.concatenate([[0.0], t])[longest + 1 - order : longest + 1]
    left = np.prod(t[longest] - old) / (order + 1)
    assert estimate(t, t**power) == pytest.approx(SAFETY * factor * left / t[-1] ** power, rel=1e-9)


def test_estimate_ignores_jumps_at_remeshings_and_the_first_moment() -> None:
    t = np.arange(1, 40) * 0.02
    smooth = np.cos(t)
    jumps = smooth + np.where(t > 0.4, 0.1, 0.0) + np.where(np.isclose(t, 0.42), 3.0, 0.0)
    assert estimate(t, jumps, mesh=(t > 0.41).astype(int)) == pytest.approx(estimate(t, smooth), rel=0.1)
    assert estimate(t, jumps) > 0.05
    assert estimate(t * 1e-4, smooth) == 0


def test_rounding_errors_of_a_rigid_pair_do_not_count() -> None:
    noise = 1e-11 * np.random.default_rng(0).uniform(-1, 1, 50)
    assert estimate(np.arange(1, 51) * 0.1, noise) < 1e-3


def test_error_to_quote_above_the_requested_accuracy_gives_a_warning() -> None:
    """Relative to the largest |dU|, after stresses have set in; nothing without estimates."""
    case = parse_case(QUESTIONS["run"], KEYS | {"dU_error": True}, "")
    for correction, shown in ((5e-3, True), (1e-3, False), (None, False)):
        errors = RunErrors.of(case.liquid_model)
        for t in np.arange(1, 21) * 0.1:
            assert not any("dU_error is up to 2 %" in str(text) for text in warnings_of_run(case, errors, Extremes()))
            part = 1.0 if t < 2 else 2.0
            estimates = None if correction is None else {dU: np.array([part * correction])}
            errors.add(float(t), 0, {dU: np.ones(1)}, estimates, 0.0)
        assert any("dU_error is up to 2 %" in str(text) for text in warnings_of_run(case, errors, Extremes())) is shown


def test_estimated_error_above_the_requested_accuracy_gives_a_warning() -> None:
    assert not long_steps(parse_case(QUESTIONS["run"], KEYS, ""), 0.009)
    (warning,) = long_steps(parse_case(QUESTIONS["run"], KEYS | {"time": {"fixed_step": 0.1}}, ""), 0.24)
    assert (
        "24 % of the largest |dU|, more than accuracy: 1%; use shorter steps (--set time.fixed_step=0.025)" in warning
    )
    assert not long_steps(parse_case(QUESTIONS["run"], KEYS | {"accuracy": "5%"}, ""), 0.04)
    assert "time.tol" in long_steps(parse_case(QUESTIONS["run"], KEYS | {"accuracy": "5%"}, ""), 0.06)[0]

"""Time and tube between two distances, against cases with exact integrals."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.result_folders import curve_of, curve_table

from pairsim.analysis.pair_motion import FORGOTTEN
from pairsim.questions.curve.answer import answer_of_curve
from pairsim.runtime.errors import InputError

D = np.geomspace(0.05, 1, 12)


def table(
    dU: np.ndarray, slope: np.ndarray, U: np.ndarray | float = 1.8, rest: float = 0.0, error: float = 0.0
) -> dict[str, np.ndarray]:
    """Columns of curve.csv: dU_held, the part of it that dU has more, and the error of dU, both relative to it."""
    U = np.broadcast_to(U, D.shape)
    more = {"dU_held": dU, "dU_error": error * np.abs(dU), "U_L": U + dU / 2, "U_T": U - dU / 2}
    return curve_table(D, dU * (1 + rest), slope, **more)


LINEAR = table(0.01 * D, np.full_like(D, 0.01))


def test_velocity_proportional_to_distance_gives_a_logarithm() -> None:
    """dU = k d: t = ln(b/a)/k. The cubic in log d between twelve points leaves 1e-5."""
    way = curve_of(LINEAR).travel(0.1, 0.5)
    assert way.time == pytest.approx(np.log(5) / 0.01, rel=1e-5)
    assert way.length == pytest.approx(1.8 * np.log(5) / 0.01, rel=1e-5)
    assert abs(way.time - np.log(5) / 0.01) < way.time_error < 1e-3 * way.time
    assert abs(way.length - 1.8 * np.log(5) / 0.01) < way.length_error < 1e-3 * way.length


@pytest.mark.parametrize("start", [0.06, 0.2, 0.24, 0.25, 0.9])
def test_a_motion_over_time_is_that_of_its_differential_equation(start: float) -> None:
    """dU is positive below its stable zero, d = 0.25, and above its unstable one, d = 0.55."""
    x = np.log(D / 0.1)
    dU = 0.01 * (x - 0.9) * (x - 1.7)
    motion, times = curve_of(table(dU, 0.01 * (2 * x - 2.6) / D)).motion, np.linspace(0, 40, 30)
    assert motion is not None
    start_x, rates = [np.log(start)], motion.rates
    way = solve_ivp(lambda _, y: np.interp(y, *rates), (0, 40), start_x, "LSODA", times, rtol=1e-9, atol=1e-12).y[0]
    assert motion.path(start, times) == pytest.approx(np.exp(np.clip(way, *np.log(D[[0, -1]]))), rel=1e-7)


def test_cubic_in_log_d_is_integrated_exactly() -> None:
    """dU = -k (1 + x^2), x = ln d, approaching: t = integral of e^x dx/(k (1 + x^2)), U = e^-x: an arctangent."""
    x = np.log(D)
    way = curve_of(table(-0.02 * (1 + x**2), -0.04 * x / D, U=1.0)).travel(0.8, 0.2)
    fine = np.linspace(np.log(0.2), np.log(0.8), 200_001)
    expected = np.trapezoid(np.exp(fine) / (1 + fine**2), fine) / 0.02
    assert way.time == pytest.approx(expected, rel=1e-9)
    assert way.length == pytest.approx(expected, rel=1e-9)


def test_the_pair_moves_with_dU_not_with_that_of_held_distances() -> None:
    way = curve_of(table(0.01 * D, np.full_like(D, 0.01), rest=0.25)).travel(0.1, 0.5)
    assert way.time == pytest.approx(np.log(5) / 0.0125, rel=1e-3)


def test_the_half_width_is_that_of_dU_everywhere_on_one_side() -> None:
    """With dU 10 % too small all along the way the time is 1/.9 of what it is."""
    way = curve_of(table(0.01 * D, np.full_like(D, 0.01), error=0.1)).travel(0.1, 0.5)
    assert way.time_error == pytest.approx(way.time * (1 / 0.9 - 1), rel=1e-2)
    assert way.length_error == pytest.approx(way.length * (1 / 0.9 - 1), rel=1e-2)


def test_the_interval_of_few_points_holds_the_exact_time() -> None:
    """Five points of dU = 1/cosh(ln(d/.2)); the exact time is an integral of e^x cosh(x - ln .2)."""
    d = np.geomspace(0.05, 0.8, 5)
    x = np.log(d / 0.2)
    columns = curve_table(d, 1 / np.cosh(x), -np.tanh(x) / np.cosh(x) / d)
    way = curve_of(columns | {"U_L": np.full(5, 1.8), "U_T": np.full(5, 1.8)}).travel(0.06, 0.7)
    fine = np.linspace(np.log(0.06), np.log(0.7), 200_001)
    exact = np.trapezoid(np.exp(fine) * np.cosh(fine - np.log(0.2)), fine)
    assert abs(way.time - exact) > 1e-4 * exact
    assert abs(way.time - exact) < way.time_error < 0.1 * exact


def test_dU_moves_the_centres_not_the_surfaces() -> None:
    """Where shapes change with the distance, c = d + .02 ln d: t = integral of (1 + .02/d) dd/(k d)."""
    way = curve_of(LINEAR | {"stretch": 1 + 0.02 / D}).travel(0.1, 0.5)
    assert way.time == pytest.approx((np.log(5) + 0.02 * (1 / 0.1 - 1 / 0.5)) / 0.01, rel=1e-3)


def test_where_dU_may_vanish_there_is_no_time() -> None:
    with pytest.raises(InputError, match="dU certainly does not vanish on the way"):
        curve_of(table(0.01 * D, np.full_like(D, 0.01), error=1.1)).travel(0.1, 0.5)


def test_an_end_of_the_curve_that_is_missed_by_rounding_is_the_end() -> None:
    """2 um in a tube of 50 um is .04 in one way of computing it and .039999999999999994 in another."""
    whole = curve_of(LINEAR).travel(0.05, 1.0)
    assert curve_of(LINEAR).travel(0.05 * (1 - 4e-16), 1.0 + 4e-16) == whole
    with pytest.raises(InputError, match="must be between"):
        curve_of(LINEAR).travel(0.05 * (1 - 1e-6), 1.0)


ZERO = table(0.01 * (D - 0.3), np.full_like(D, 0.01))


@pytest.mark.parametrize(
    ("start", "stop", "key", "message"),
    [
        (0.1, 0.5, "stop", r"same side of the zeros of dU as d = 0.1: dU = 0 at d = 0.3"),
        (0.5, 0.1, "stop", r"same side of the zeros"),
        (0.01, 0.1, "start", "between d = 0.05 and d = 1"),
        (0.4, 2.0, "stop", "between d = 0.05 and d = 1"),
        (0.4, 0.35, "stop", "the pair separates there"),
        (0.1, 0.2, "stop", "the pair approaches there"),
        (0.4, 0.4, "stop", "must differ"),
        (float("nan"), 0.4, "start", "between"),
    ],
)
def test_what_cannot_be_reached_is_refused(start: float, stop: float, key: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        curve_of(ZERO).travel(start, stop)
    assert caught.value.key == key


@pytest.mark.parametrize(
    ("start", "stop", "message"),
    [
        ("5um", "17um", "stop: got '17um'; must be between d = 5 um and d = 15 um, the ends of the curve"),
        ("4um", "10um", "start: got '4um'; must be between d = 5 um"),
        ("0.1", "0.34", "stop: got 0.34; must be between"),
    ],
)
def test_messages_show_the_distance_as_it_was_typed(start: str, stop: str, message: str) -> None:
    """17 um in a tube of 50 um is .33999999999999997 D_c in double precision."""
    record = {"scales": {"length": 50e-6, "time": 0.005, "velocity": 0.01, "stress": 170.0}}
    columns = curve_table(np.array([0.1, 0.3]), np.full(2, 1e-3), np.zeros(2), U_L=np.ones(2), U_T=np.ones(2))
    with pytest.raises(InputError, match=re.escape(message)):
        curve_of(columns, [], record).travel(start, stop)


def test_curve_of_one_particle_has_no_way() -> None:
    with pytest.raises(InputError, match="curve of a pair"):
        curve_of({"U_1": D}).travel(0.1, 0.2)


def decaying(rate: float, t_relax: float, **more: np.ndarray) -> dict[str, np.ndarray]:
    """dU = rate d: the distance is d_0 exp(rate t)."""
    one = np.ones(12)
    columns = {"dU_error": 1e-6 * one, "t_relax": t_relax * one, "U_L": one, "U_T": one, **more}
    return curve_table(D, rate * D, np.full(12, rate), **columns)


def test_a_start_is_forgotten_three_decay_times_later() -> None:
    assert curve_of(decaying(0.2, 1.0)).forgotten(0.1) == pytest.approx(0.1 * np.exp(0.2 * FORGOTTEN), rel=1e-2)
    assert curve_of(decaying(-0.2, 1.0)).forgotten(0.5) == pytest.approx(0.5 * np.exp(-0.2 * FORGOTTEN), rel=1e-2)
    slower = decaying(0.2, 1.0, stretch=np.full(12, 0.5))  # the surfaces part twice as fast as the centres
    assert curve_of(slower).forgotten(0.1) == pytest.approx(0.1 * np.exp(0.4 * FORGOTTEN), rel=1e-2)


def test_a_pair_that_leaves_the_curve_before_has_not_forgotten_its_start() -> None:
    assert curve_of(decaying(0.2, 10.0)).forgotten(0.1) == np.inf


def test_a_pair_that_comes_to_rest_has_all_the_time() -> None:
    dU = 0.2 * np.log(0.3 / D)
    resting = decaying(0.2, 5.0) | {"dU": dU, "dU_held": dU, "dU_discrete": dU, "slope": -0.2 / D}
    found = curve_of(resting).forgotten(0.1)
    assert found is not None
    assert 0.25 < found <= 0.3


def test_without_memory_a_start_is_forgotten_at_once_and_without_decay_times_it_is_not_known() -> None:
    assert curve_of(decaying(0.2, 0.0)).forgotten(0.1) == pytest.approx(0.1, rel=0.02)
    assert curve_of(decaying(0.2, np.nan)).forgotten(0.1) is None


def test_a_start_from_rest_changes_the_time_by_how_far_it_is_behind() -> None:
    """.002 D_c behind, at dU = .2 * .1, are .1 D_c/U_av; a curve without the column says nothing of it."""
    table = decaying(0.2, 1.0, U_L=1.8 + 0.1 * D, U_T=1.8 - 0.1 * D)
    way = curve_of(table | {"from_rest": 0.02 * D}).travel(0.1, 0.9)
    assert way.start_error == pytest.approx(0.1, rel=0.02)
    assert "one that starts there has forgotten its start by d = " in str(way)
    assert str(way).endswith(", and takes up to about 0.1 D_c/U_av more or less if it starts from rest")
    before = curve_of(table).travel(0.1, 0.9)
    assert before.start_error is None
    assert "forgotten" in str(before)
    assert "from rest" not in str(before)


def test_the_answer_says_so_where_it_is_far() -> None:
    slow = answer_of_curve(curve_of(decaying(0.2, 1.0, dU_held=1.1 * 0.2 * D)))[1]
    assert slow.startswith("A pair that starts at d = 0.05 follows this curve from d = 0.091")
    assert "held distance: dU_held, 10 % more" in slow
    held = answer_of_curve(curve_of(decaying(0.2, 1.0, dU_held=1.1 * 0.2 * D)))[2]
    free, fixed = (f"+{rate * D[-1]:.7f} +- 0.0000010" for rate in (0.2, 0.22))
    assert held.startswith(f"At d = {D[-1]:.4g} a pair that moves freely has dU = {free}; one whose distance is held, ")
    assert held.endswith(f"has dU_held = {fixed}.")
    assert "forgotten" not in "".join(answer_of_curve(curve_of(decaying(0.2, 0.02))))

"""Waveforms of a flow: values, kinks, means, and what a table of a pump gives."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from pairsim.physics.drive import Drive
from pairsim.physics.waveform import Polyline, Sine, Waveform, ramp, square, table, triangle

PERIODIC = {
    "sine": Sine(2.0, 0.3, 1.0),
    "square": square(2.0, 0.3, 1.0),
    "triangle": triangle(2.0, 0.3, 1.0),
    "one direction": Sine(0.5, 1.0, 0.03),
    "backward": triangle(0.7, -2.0, 1.0),
    "log": Polyline((0.0, 0.5, 1.2, 1.2, 2.0), (0.0, 1.0, -0.5, 2.0, 0.0), repeats=True),
}


def pieces(waveform: Waveform, end: float) -> list[float]:
    """0, all kinks, and the end."""
    found = [0.0]
    while (kink := waveform.next_kink(found[-1])) < end - 1e-9:
        found.append(kink)
    return [*found, end]


@pytest.mark.parametrize("waveform", PERIODIC.values(), ids=PERIODIC)
def test_means_are_those_of_the_integrals_between_kinks(waveform: Waveform) -> None:
    places = pieces(waveform, waveform.cycle)
    size = sum(quad(lambda t: abs(waveform.at(t)), a, b, epsabs=1e-12, limit=400)[0] for a, b in pairwise(places))
    net = sum(quad(waveform.at, a, b, epsabs=1e-12)[0] for a, b in pairwise(places))
    assert waveform.mean_size == pytest.approx(size / waveform.cycle, rel=1e-8)
    assert waveform.mean == pytest.approx(net / waveform.cycle, rel=1e-8)
    largest = max(abs(waveform.at(t)) for t in np.linspace(0, waveform.cycle, 1001))
    assert waveform.largest == pytest.approx(largest, rel=1e-2)


@pytest.mark.parametrize("waveform", PERIODIC.values(), ids=PERIODIC)
def test_the_slope_is_the_derivative_and_the_flow_repeats_on_both_sides_of_its_kinks(waveform: Waveform) -> None:
    for t in np.linspace(0.013, waveform.cycle, 17)[:-1]:
        step = 1e-6
        assert waveform.slope(t) == pytest.approx((waveform.at(t + step) - waveform.at(t - step)) / 2e-6, abs=1e-6)
    for cycles in (1, 7, 1234):
        for t in [*pieces(waveform, waveform.cycle)[1:-1], 0.1]:
            later = cycles * waveform.cycle + t
            assert waveform.at(later) == pytest.approx(waveform.at(t), abs=1e-8)
            assert waveform.after(later) == pytest.approx(waveform.after(t), abs=1e-8)


def test_kinks_are_where_the_slope_or_the_flow_jumps_and_nowhere_else() -> None:
    assert pieces(triangle(4.0, 0.0, 1.0), 8.0) == [0, 1, 3, 5, 7, 8]  # none where it passes the mean
    assert pieces(square(4.0, 0.0, 1.0), 8.0) == [0, 2, 4, 6, 8]
    assert pieces(Sine(1.0, 0.0, 1.0), 3.0) == [0, 3]
    assert pieces(square(4.0, 1.0, 0.0), 8.0) == [0, 8]
    assert pieces(ramp(2.0, 0.5, 0.5), 9.0) == [0, 2, 9]


def test_a_step_that_ends_at_a_jump_has_the_flow_before_it() -> None:
    flow = square(2.0, 0.0, 1.0)
    assert (flow.at(0.0), flow.at(1.0), flow.after(1.0), flow.at(2.0), flow.after(2.0)) == (1, 1, -1, -1, 1)
    late = 3001 * 0.7 / 2  # a multiple of the half period that rounding may miss
    assert square(0.7, 0.0, 1.0).at(late) == pytest.approx(1.0)
    assert square(0.7, 0.0, 1.0).after(late) == pytest.approx(-1.0)


def test_a_ramp_and_a_table_stay_at_their_last_flow() -> None:
    rising, pump = ramp(2.0, 0.5, 0.5), table([10.0, 11.0, 12.0], [1.0, 3.0, 2.0])
    assert [rising.at(t) for t in (0.0, 1.0, 2.0, 50.0)] == [0.0, 0.5, 1.0, 1.0]
    assert [pump.at(t) for t in (0.0, 0.5, 1.0, 1.5, 2.0, 9.0)] == [1.0, 2.0, 3.0, 2.5, 2.0, 2.0]
    assert pump.mean == pytest.approx(2.25)
    assert pump.slope_after(2.0) == 0.0
    assert math.isinf(pump.next_kink(2.0))
    assert rising.period is None


@pytest.mark.parametrize("times", [[0.0], [0.0, 1.0, 0.5], [0.0, 1.0, 1.0, 1.0, 2.0], [0.0, 0.0, 1.0], [0.0, math.nan]])
def test_times_that_do_not_ascend_make_no_table(times: list[float]) -> None:
    with pytest.raises(ValueError, match="must"):
        table(times, [1.0] * len(times))


def test_a_constant_flow_is_driven_as_ever() -> None:
    assert Drive().flow_at(7.0) == 1.0
    assert math.isinf(Drive().next_kink(0.0))
    assert Drive.varying(square(2.0, 0.5, 1.0)).flow == 1.5

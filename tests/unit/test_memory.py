"""Where a pair has forgotten its start, against an exact integral."""

from __future__ import annotations

import numpy as np
import pytest
from support.result_folders import curve_table

from pairsim.questions.curve import answer_of_curve
from pairsim.results.memory import FORGOTTEN, forgotten_at

D = np.geomspace(0.05, 1.0, 9)


def table(rate: float, t_relax: float, **more: np.ndarray) -> dict[str, np.ndarray]:
    """dU = rate d: the distance is d_0 exp(rate t)."""
    columns = {"dU_error": np.full(9, 1e-6), "t_relax": np.full(9, t_relax), **more}
    return curve_table(D, rate * D, np.full(9, rate), **columns)


def test_a_start_is_forgotten_three_decay_times_later() -> None:
    assert forgotten_at(table(0.2, 1.0), 0.1) == pytest.approx(0.1 * np.exp(0.2 * FORGOTTEN), rel=1e-2)
    assert forgotten_at(table(-0.2, 1.0), 0.5) == pytest.approx(0.5 * np.exp(-0.2 * FORGOTTEN), rel=1e-2)
    slower = table(0.2, 1.0, stretch=np.full(9, 0.5))  # the surfaces part twice as fast as the centres
    assert forgotten_at(slower, 0.1) == pytest.approx(0.1 * np.exp(0.4 * FORGOTTEN), rel=1e-2)


def test_a_pair_that_leaves_the_curve_before_has_not_forgotten_its_start() -> None:
    assert forgotten_at(table(0.2, 10.0), 0.1) == np.inf


def test_a_pair_that_comes_to_rest_has_all_the_time() -> None:
    resting = curve_table(D, 0.2 * np.log(0.3 / D), -0.2 / D, dU_error=np.full(9, 1e-6), t_relax=np.full(9, 5.0))
    found = forgotten_at(resting, 0.1)
    assert found is not None
    assert 0.25 < found <= 0.3


def test_without_memory_a_start_is_forgotten_at_once_and_without_decay_times_it_is_not_known() -> None:
    assert forgotten_at(table(0.2, 0.0), 0.1) == pytest.approx(0.1, rel=0.02)
    assert forgotten_at(table(0.2, np.nan), 0.1) is None


def test_the_answer_says_so_where_it_is_far() -> None:
    slow = answer_of_curve(table(0.2, 1.0, dU_held=1.1 * 0.2 * D), [], {})[1]
    assert slow.startswith("A pair that starts at d = 0.05 follows this curve from d = 0.091")
    assert "held distance: 10 % more" in slow
    assert "forgotten" not in "".join(answer_of_curve(table(0.2, 0.02), [], {}))

"""The answer of a run in words: the start-up apart from the motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from syrupy.assertion import SnapshotAssertion

from pairsim.questions.run_answer import answer_of_run
from pairsim.results.settled import SETTLED, start_up


def series(t: float, d: list[float], dU: list[float], **more: list[float]) -> dict[str, np.ndarray]:
    times = np.linspace(0.0, t, len(d))
    return {"t": times, **{name: np.array(values) for name, values in {"d": d, "dU": dU, **more}.items()}}


def settled(dU: float, error: float, **more: Any) -> dict[str, Any]:
    """run.json of a run in which a disturbance decays in a time of 1."""
    entry = {"d": [0.1], "dU": [dU], "dU_error": [error], "t_relax": 1.0, "start": "rest", "accuracy": 0.01}
    return {"reason": "end", SETTLED: entry | more}


@pytest.mark.parametrize(
    ("dU", "found"),
    [
        pytest.param(1.5e-2, settled(1.5e-2, 1e-4), id="separates"),
        pytest.param(-1.5e-2, settled(-1.5e-2, 1e-4), id="comes closer"),
        pytest.param(1e-4, settled(1e-4, 2e-4), id="below its error"),
        pytest.param(-5e-6, settled(2e-5, 1.5e-5), id="contradicts the curve within the errors of both"),
        pytest.param(1e-12, settled(2e-12, 1e-14), id="keeps its distance"),
    ],
)
def test_a_decayed_start_up_leaves_three_answers(dU: float, found: dict[str, Any], snapshot: SnapshotAssertion) -> None:
    assert answer_of_run(series(10.0, [0.1, 0.08, 0.09], [-1e-2, 1e-3, dU]), found) == snapshot


@pytest.mark.parametrize("dU", [4e-3, -4e-3, 2e-5])
def test_a_run_cut_short_is_still_starting_up(dU: float, snapshot: SnapshotAssertion) -> None:
    """It says where dU is heading, and not which way it has been."""
    assert answer_of_run(series(2.0, [0.1, 0.09], [-1e-2, -1e-2]), settled(dU, 5e-5)) == snapshot


def test_three_decay_times_are_waited_for_after_rest() -> None:
    """dU may pass the value of quasi-steady motion on its way; from a quasi-steady state nothing is waited for."""
    passing = series(1.0, [0.1, 0.11], [1e-2, 1.5e-2])
    record = settled(1.5e-2, 1e-4)
    assert "is still starting up" in answer_of_run(passing, record)[0]
    assert start_up(record) == 3.0
    steady = settled(1.5e-2, 1e-4, start="steady")
    assert "separates" in answer_of_run(passing, steady)[0]
    assert start_up(steady) == 0.0


def test_advised_end_leaves_the_difference_within_the_errors() -> None:
    """Of 1e-3 at t = 4 that decay like exp(-t), 2e-4 are left at t = 5.6."""
    line = answer_of_run(series(4.0, [0.1, 0.11], [1e-2, 1.1e-2]), settled(1e-2, 1e-4))[0]
    end = float(line.partition("time.end = ")[2].split()[0])
    assert 4 + np.log(5) < end < 4 + np.log(5) + 1


def test_the_runs_own_error_counts_where_it_is_estimated() -> None:
    off = {"d": [0.1, 0.11], "dU": [1e-2, 1.1e-2]}
    record = settled(1e-2, 1e-4)
    assert "is still starting up" in answer_of_run(series(10.0, **off), record)[0]
    lines = answer_of_run(series(10.0, **off, dU_error=[2e-3, 2e-3]), record)
    assert "separates" in lines[0]
    assert "dU = +0.011 +- 0.002 at the end" in lines[0]


@pytest.mark.parametrize(
    ("d", "dU"),
    [
        pytest.param([0.1, 0.12], [1e-2, 2e-2], id="separates"),
        pytest.param([0.12, 0.1], [-1e-2, -2e-2], id="comes closer"),
        pytest.param([0.1, 0.09], [-1e-2, 2e-2], id="turns"),
        pytest.param([0.1, 0.12], [1e-2, 1e-12], id="stands still"),
    ],
)
def test_without_a_quasi_steady_solution_the_run_speaks_for_itself(
    d: list[float], dU: list[float], snapshot: SnapshotAssertion
) -> None:
    lines = answer_of_run(series(1.0, d, dU), {"reason": "end", SETTLED: {"message": "there is a fold"}})
    assert lines == snapshot
    assert answer_of_run(series(1.0, d, dU), {"reason": "end"}) == lines[:1]


def test_a_run_that_ends_in_contact_collides(snapshot: SnapshotAssertion) -> None:
    assert answer_of_run(series(1.0, [0.1, 0.004], [-1e-2, -1e-2]), {"reason": "contact"}) == snapshot


def test_a_run_whose_dU_is_below_its_error_has_no_sign(snapshot: SnapshotAssertion) -> None:
    assert answer_of_run(series(1.0, [0.1, 0.1], [1e-4, 1e-4], dU_error=[2e-4, 2e-4]), {}) == snapshot


def test_every_gap_of_three_particles_has_its_line(snapshot: SnapshotAssertion) -> None:
    table = {"t": np.array([10.0]), "d_1": np.array([0.1]), "d_2": np.array([0.2])}
    table |= {"dU_1": np.array([1e-2]), "dU_2": np.array([-1e-2]), "D_1": np.array([0.01])}
    record = settled(1e-2, 1e-4)
    record[SETTLED] |= {"dU": [1e-2, 1e-2], "dU_error": [1e-4, 1e-4]}
    assert answer_of_run(table, record) == snapshot


def test_many_gaps_are_counted_and_their_mean_is_told() -> None:
    d, dU = [0.1, 0.2, 0.2, 0.3, 0.2], [-1e-2, 1e-2, 1e-2, 0.0, 1e-2]
    table = {"t": np.array([0.0, 10.0])}
    table |= {f"d_{i}": np.array([0.2, end]) for i, end in enumerate(d, 1)}
    table |= {f"dU_{i}": np.array([0.0, value]) for i, value in enumerate(dU, 1)}
    counted, spread = answer_of_run(table, {"reason": "contact"})[1:]
    assert answer_of_run(table, {"reason": "contact"})[0] == "Gap 1 collides."
    assert counted.startswith("Of 5 gaps at t = 10: 3 separating, 1 coming closer, 1 not decided")
    assert spread.startswith(f"Their mean went from 0.2 to 0.2, their standard deviation from 0 to {np.std(d):.5g};")
    assert spread.endswith("the smallest is gap 1, 0.1, the largest gap 4, 0.3.")

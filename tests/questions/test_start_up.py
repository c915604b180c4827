"""What a run says of a pair that first comes closer and then separates, as the curve does."""

from __future__ import annotations

import signal
from typing import Any

import pytest

import pairsim
from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.problems import Problem

EXPERIMENT = {"tube": "50um", "particle": "15um", "viscosity": "0.05Pa.s", "relaxation": "20ms", "modulus": "500Pa"}
CASE: dict[str, Any] = {"physical": {**EXPERIMENT, "flow_rate": "0.5ul/min"}, "accuracy": "5%"}
FEW = {"ends": "developed", "length": "auto", "output": {"fields": False}}


@pytest.mark.long
def test_run_and_curve_give_one_answer() -> None:
    """De 1.7: the run comes closer by 2 % of the distance before it separates."""
    whole = pairsim.run(CASE, **FEW, d0=0.1)
    t, d, dU = (whole.table[name].iloc[-1] for name in ("t", "d", "dU"))
    assert t == pytest.approx(10.2)
    assert d < 0.1
    assert whole.answer.startswith("The pair separates: ")
    assert "While it started up it came closer." in whole.answer
    curve = pairsim.curve(CASE, ends="developed", length="auto", d=[float(d)]).table
    assert abs(dU - curve["dU"][0]) < 2 * curve["dU_error"][0]
    assert curve["dU"][0] > curve["dU_error"][0]


@pytest.mark.slow
def test_a_soft_pair_that_starts_steady_has_no_start_up() -> None:
    keys = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "mesh": {"Np": 12}, "time": {"end": 0.2}}
    assert pairsim.run(keys, **FEW).answer.startswith("The pair is still starting up: ")
    steady = pairsim.run(keys, **FEW, start="steady")
    assert steady.answer.startswith("The pair separates: ")
    assert steady.record["settled"]["dU"] == pytest.approx(steady.table["dU"].iloc[-1:], rel=0.01)


SOFT = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "mesh": {"Np": 8, "max_size": 0.3}, "time": {"end": 0.002}}


@pytest.mark.parametrize("stopped", [False, True])
def test_a_run_is_finished_without_its_quasi_steady_solution(stopped: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether there is none or a signal came meanwhile."""

    def settled(problem: Problem, _: object) -> None:
        if stopped:
            signal.raise_signal(signal.SIGTERM)
        problem.monitor.check()
        raise NoSteadyState("the shapes end")

    monkeypatch.setattr("pairsim.questions.run.computation.settled", settled)
    result = pairsim.run(SOFT, **FEW, signals=True)
    why = "the quasi-steady solution at the last distances was interrupted" if stopped else "the shapes end"
    assert result.status == "finished"
    assert f"Whether the start-up has decayed is not known: {why}." in result.answer


@pytest.mark.slow
def test_without_a_quasi_steady_state_a_run_cannot_start_from_it() -> None:
    result = pairsim.run({**SOFT, "Ca_e": 1, "start": "steady"}, **FEW)
    assert (result.status, result.reason) == ("failed", "not_resolved")
    assert "no quasi-steady state to start from" in result.message
    assert result.message.endswith("try start: rest")

"""`--budget`: a computation ends when its time is over, and keeps what is known by then."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import pairsim as api
from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import steady_problem
from pairsim.computing.progress import Reporter
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import BudgetSpent
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.curves.scout import found_within
from pairsim.solvers.parameters import Parameters


@pytest.fixture(autouse=True)
def _a_second_a_solve(monkeypatch: pytest.MonkeyPatch) -> None:
    """Budgets are counted in solves."""
    clocks = {name: count().__next__ for name in ("monotonic", "process_time")}
    monkeypatch.setattr("pairsim.runtime.monitor.time", SimpleNamespace(**clocks))


PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": 3, "mesh": {"Np": 8}, "tol": 1}


@pytest.mark.slow
def test_a_curve_keeps_the_points_it_has_when_its_budget_is_spent() -> None:
    result = api.curve(PAIR | {"d": {"start": 0.05, "stop": 0.8, "num": 500}}, budget="20 s")
    assert (result.status, result.reason) == ("failed", "budget")
    assert 1 <= len(result.table) < 500
    assert "the budget of 20 s is spent, while solving at Ca_e = 0.1, d = 0." in result.message


def test_a_point_is_kept_when_the_budget_is_spent_on_finer_cells_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def spent(*_: object) -> None:
        raise BudgetSpent("the budget of 60 s is spent")

    monkeypatch.setattr("pairsim.solvers.curves.adaptation.carried_over", spent)
    finer = {key: value for key, value in PAIR.items() if key != "mesh"} | {"d": [0.1], "accuracy": "0.02%"}
    result = api.curve(finer, budget="1000 s")
    assert (result.status, len(result.table)) == ("finished", 1)
    assert any("accuracy: 0.02% was not kept" in warning for warning in result.warnings)


def test_what_is_passed_on_the_way_to_the_first_point_is_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    places: list[str] = []
    monkeypatch.setattr(Reporter, "on_the_way", lambda _, place, **__: places.append(place))
    case = PAIR | {"De": 1, "Ca_e": 0.2, "d": [0.1], "mesh": {"Np": 16, "max_size": 0.07}}
    result = api.curve(case, budget="2 s", folder=tmp_path / "out")
    assert result.reason == "budget"
    assert len(result.table) == 0
    assert places
    assert all(place.startswith("De = ") for place in places)
    assert len((tmp_path / "out" / "way.csv").read_text().splitlines()) > 1


def test_a_limit_says_where_the_computation_is_until_it_has_a_result() -> None:
    places: list[str] = []
    monitor = Monitor(patience=3.0, listener=places.append)
    part = monitor.within(9.0, "it was not found within {}")
    part.at("De = 0.5")
    with pytest.raises(
        BudgetSpent, match=r"nothing was found within 3 s of processor time, while solving at De = 0\.5"
    ):
        spend(part)
    monitor.at("De = 1")
    assert not part.knows_result
    monitor.has_result()
    assert part.knows_result
    with pytest.raises(BudgetSpent, match="it was not found within 9 s"):
        spend(part)
    spend(monitor)
    assert places == ["De = 0.5", "De = 1"]


def test_a_busy_machine_ends_nothing_that_has_no_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    busy = SimpleNamespace(monotonic=count(step=1000).__next__, process_time=lambda: 0.0)
    monkeypatch.setattr("pairsim.runtime.monitor.time", busy)
    spend(Monitor(patience=3.0))
    with pytest.raises(BudgetSpent, match="the budget of 3 s is spent"):
        spend(Monitor(budget=3.0))


def test_a_search_on_finer_cells_has_a_time_of_its_own() -> None:
    case = parse_case(QUESTIONS["curve"], {"particles": 1, "beta": 0.4, "Ca_e": 0.1, "mesh": {"Np": 6}}, "test")
    problem, first = steady_problem(case, np.inf), Parameters((), case.solid_models, case.liquid_model)
    assert found_within(0.5, problem, first) is None, "the problem has no limit, the search has one"
    found = found_within(1000.0, problem, first)
    assert found is not None
    with closing(found):
        assert found.problem is problem, "what follows has no limit again"
    with pytest.raises(BudgetSpent, match="the budget of 0 s is spent"):
        found_within(1000.0, replace(problem, monitor=Monitor(budget=0.0)), first)


def test_a_point_is_kept_when_a_search_on_finer_cells_for_it_takes_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pairsim.solvers.curves.adaptation.carried_over", lambda *_: None)
    monkeypatch.setattr("pairsim.solvers.curves.adaptation.LONGEST_SEARCH", 0.5)
    result = api.shape({"beta": 0.4, "De": 0, "Ca_e": 0.1}, accuracy="0.1%")
    assert (result.status, len(result.table)) == ("finished", 1)
    assert any("accuracy: 0.1% was not kept" in warning for warning in result.warnings)


def spend(monitor: Monitor) -> None:
    """Check ten times."""
    for _ in range(10):
        monitor.check()


@pytest.mark.slow
def test_a_command_that_finds_nothing_ends_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pairsim.questions.compute.PATIENCE", 3.0)
    found = api.curve(PAIR | {"De": 1, "Ca_e": 0.2, "d": [0.1], "mesh": {"Np": 16, "max_size": 0.07}})
    assert (found.status, found.reason) == ("failed", "budget")
    assert "nothing was found within 3 s of processor time, while solving at De = " in found.message
    monkeypatch.setattr("pairsim.questions.compute.PATIENCE", 20.0)
    many = api.curve(PAIR | {"Ca_e": 0.02, "d": {"start": 0.05, "stop": 0.8, "num": 20}})
    assert many.status == "finished", "it ends nothing that has begun to have results"


def test_the_time_of_a_computation_has_that_before_it_was_resumed_and_is_that_of_its_parts_too() -> None:
    """A clock that is a second later each time that it is read."""
    monitor = Monitor(before=100.0)
    assert (monitor.passed, monitor.wall_time) == (1, 102)
    part = monitor.within(9.0, "it was not found within {}")
    assert part.wall_time > 102
    assert part.wall_time < monitor.wall_time

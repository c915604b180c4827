"""One case on several cores: the same answer, and what becomes of it when processes end."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from support.commands import descendants, words_of
from support.frames import frames_everywhere

import pairsim
from pairsim.computing.problems import steady_problem
from pairsim.computing.solved_rows import solved_rows
from pairsim.computing.workers import ALONE, FOLDER, Desk, Shared, Workers, found_in_parts
from pairsim.runtime import child
from pairsim.runtime.child_process import module_command
from pairsim.runtime.errors import InputError
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.others import found_by_all
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.rows.short_rows import Chain

PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.05, "ends": "developed", "length": 3, "mesh": {"Np": 10, "max_size": 0.2}}
CURVE = PAIR | {"d": [0.1, 0.16, 0.25, 0.4], "tol": 1, "fields": [0.1, 0.4]}
SHAPE = PAIR | {"particles": 1, "along": [0.02, 0.05, 0.1]}
PATIENCE = 300.0  # seconds


class Promised:
    """Others that find what they are told to, in place of processes."""

    def __init__(self, *found: int) -> None:
        self._found = list(found)

    def share(self, places: Any) -> Any:
        """Leave the first one to this process."""
        return places[:1]

    def come(self) -> Iterator[tuple[int, str]]:
        """Yield one place."""
        while self._found:
            yield self._found[0], f"theirs {self._found.pop(0)}"
            return

    def rest(self, meanwhile: Any) -> Iterator[tuple[int, str]]:
        """Yield the others."""
        meanwhile()
        yield from ((place, f"theirs {place}") for place in self._found)


def test_what_others_have_not_found_is_found_here() -> None:
    missing = []
    found = found_by_all([1, 2, 3, 4], lambda place: f"ours {place}", Promised(4, 2), lambda left: missing.append(left))
    assert [*found] == [(1, "ours 1"), (4, "theirs 4"), (2, "theirs 2"), (3, "ours 3")]
    assert missing == [{2, 3}]


def test_results_are_in_order_where_that_is_asked_for() -> None:
    found = found_by_all([1, 2, 3, 4], lambda place: f"ours {place}", Promised(4, 2), in_order=True)
    assert [place for place, _ in found] == [1, 2, 3, 4]


@pytest.mark.parametrize(("processes", "more", "sizes"), [(2, 0, [5, 5]), (2, 2, [4, 6]), (4, 2, [1, 3, 3, 3])])
def test_this_process_has_fewer_places_where_it_has_more_to_do(
    processes: int, more: float, sizes: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Any] = []
    those = Workers(processes)
    monkeypatch.setattr(those, "start", lambda work, *_: given.append(work.args[-1]))
    shared = Shared[int, int](those, Monitor(), lambda places, desk: iter(()), given.append)
    places = [*range(10)]
    mine = shared.share(places, more)
    assert [len(mine), *map(len, given)] == sizes
    assert [*mine, *(each for part in given for each in part)] == places


def test_what_killed_workers_have_left_is_removed_without_workers_too(tmp_path: Path) -> None:
    (tmp_path / FOLDER).mkdir()
    (tmp_path / FOLDER / "part1").touch()
    with ALONE.at_work_in(tmp_path):
        assert not (tmp_path / FOLDER).exists()


def test_parts_are_computed_here_one_after_another_without_workers() -> None:
    seen = []

    def part(number: int, desk: Desk) -> Iterator[int]:
        seen.append(number)
        yield from (number, 10 * number)

    parts = [lambda desk, i=i: part(i, desk) for i in (1, 2)]
    found = found_in_parts(ALONE, Monitor(), parts)
    assert next(found) == (0, 1)
    assert seen == [1], "a result is there before the next part is begun"
    assert [*found] == [(0, 10), (1, 2), (1, 20)]


@pytest.fixture(scope="module")
def alone() -> pairsim.CurveResult:
    """The curve of one process."""
    return pairsim.curve(CURVE)


@pytest.mark.slow
@pytest.mark.parametrize("executor", [False, True])
def test_a_curve_is_that_of_one_process(executor: bool, alone: pairsim.CurveResult, tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as threads:
        found = pairsim.curve(CURVE, folder=tmp_path / "out", workers=2, executor=threads if executor else None)
    assert found.check().status == "finished"
    assert list(found.table) == list(alone.table)
    assert found.table["d"].to_numpy() == pytest.approx(alone.table["d"].to_numpy(), rel=1e-12)
    for name, half in (("dU", "dU_error"), ("U_L", "U_error_L")):
        off = np.abs(found.table[name] - alone.table[name])
        assert (off <= found.table[half] + 1e-12).all(), name
    assert found.table["newton"].sum() > alone.table["newton"].sum() - len(alone.table)
    assert found.record["warnings"] == alone.record["warnings"]
    assert found.record["points"] == alone.record["points"]
    assert found.record["factorisations"] > alone.record["factorisations"], "those of both processes"
    assert [frame.t for frame in frames_everywhere(tmp_path / "out")] == pytest.approx([0.1, 0.4])
    assert not (tmp_path / "out" / FOLDER).exists()


@pytest.mark.slow
def test_one_worker_changes_nothing(alone: pairsim.CurveResult) -> None:
    again = pairsim.curve(CURVE, workers=1)
    for name in ("d", "dU", "dU_error", "slope", "newton"):
        assert list(again.table[name]) == list(alone.table[name])


@pytest.mark.slow
def test_shapes_are_those_of_one_process_in_the_same_order() -> None:
    one, two = (pairsim.shape(SHAPE, workers=number) for number in (1, 2))
    assert list(two.table) == list(one.table)
    assert list(two.table["Ca_e"]) == list(one.table["Ca_e"])
    assert (np.abs(two.table["D_1"] - one.table["D_1"]) <= two.table["D_error"]).all()


@pytest.mark.slow
def test_critical_distances_are_those_of_one_process() -> None:
    case = PAIR | {"De": 0.5, "d": [0.2, 0.3], "along": {"Ca_e": [0.08, 0.1]}, "mesh": {"Np": 8, "max_size": 0.3}}
    one, two = (pairsim.critical(case, workers=number).check().table for number in (1, 2))
    assert list(two) == list(one)
    one, two = (table[table["kind"] == "wanted"].reset_index() for table in (one, two))  # others follow the zeros
    assert list(two["Ca_e"]) == list(one["Ca_e"])
    assert len(one) >= 2
    assert (np.abs(two["d_cr"] - one["d_cr"]) <= two["d_error"]).all()


@pytest.mark.slow
def test_rates_off_the_axis_are_those_of_one_process() -> None:
    case = PAIR | {"particles": 1, "along": {"beta": [0.3, 0.4]}, "Ca_e": 0, "De": 0.3}
    one, two = (pairsim.focus(case, workers=number).check().table for number in (1, 2))
    assert list(two) == list(one)
    assert (np.abs(two["growth"] - one["growth"]) <= two["growth_error"]).all()


@pytest.mark.slow
def test_short_rows_are_solved_by_all_processes_and_keep_their_order() -> None:
    case = pairsim.load(PAIR | {"particles": 1, "De": 0}, kind="curve")
    problem, alone = steady_problem(case, np.inf), Parameters((), case.solid_models)
    chains = [Chain([()]), Chain([(0.4,), (0.3,), (0.2,), (0.15,), (0.1,), (0.08,), (0.06,), (0.05,)])]
    found = []
    for number in (1, 2):
        with Workers(number) as those, TemporaryDirectory() as folder, those.at_work_in(Path(folder)):
            solving = solved_rows(replace(problem, volume_modulus=False), alone, chains, (), those)
            found.append(returned(solving)[0])
    assert [row.gaps.tolist() for row in found[1]] == [row.gaps.tolist() for row in found[0]]
    for one, two in zip(*found, strict=True):
        assert (np.abs(two.dU - one.dU) <= one.dU_error + two.dU_error).all()


@pytest.mark.slow
def test_a_killed_worker_costs_time_alone(
    alone: pairsim.CurveResult, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """What it has not found is computed by this process, which says so."""
    started: list[subprocess.Popen[bytes]] = []
    begin, points = child.Child.__init__, count(1)

    def counted(new: child.Child, environment: Any) -> None:
        begin(new, environment)
        started.append(new.process)

    def killing(shared: Shared[Any, Any]) -> Iterator[Any]:
        for each in come(shared):
            if next(points) == 1:
                started[0].kill()
            yield each

    come = Shared.come
    monkeypatch.setattr(child.Child, "__init__", counted)
    monkeypatch.setattr(Shared, "come", killing)
    found = pairsim.curve(CURVE, workers=2, progress=True)
    assert found.check().status == "finished"
    assert started[0].returncode == -signal.SIGKILL
    assert "a worker ended early" in capfd.readouterr().err
    assert found.table["d"].to_numpy() == pytest.approx(alone.table["d"].to_numpy(), rel=1e-12)
    assert (np.abs(found.table["dU"] - alone.table["dU"]) <= found.table["dU_error"]).all()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_all_processes_in_order(number: int, tmp_path: Path) -> None:
    words = module_command("pairsim", "curve", "in.yaml", "-o", "out", "--workers", "2", "-q")
    distances = "{start: 0.05, stop: 0.5, num: 200}"
    keys = "beta: 0.4\nDe: 0\nCa_e: 0.1\nends: developed\nlength: 3\nmesh: {Np: 8, max_size: 0.3}\ntol: 1\n"
    (tmp_path / "in.yaml").write_text(f"{keys}d: {distances}\n")
    table = tmp_path / "out" / "curve.csv"
    job = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        deadline = time.monotonic() + PATIENCE
        while not table.exists() or len(ranges_of(table)) < 2:
            assert job.poll() is None, job.communicate()[1]
            assert time.monotonic() < deadline
            time.sleep(0.05)
        children = [pid for pid in descendants(job.pid) if child.MODULE in words_of(pid)]
        assert len(children) == 1
        job.send_signal(number)
        _, complaint = job.communicate(timeout=PATIENCE)
    finally:
        job.kill()
    assert job.returncode == 130, complaint
    assert "Traceback" not in complaint
    assert "the results written so far are kept" in (tmp_path / "out" / "run.json").read_text()
    assert table.read_text().endswith("\n")
    assert not any(child.MODULE in words_of(pid) for pid in children)
    assert not (tmp_path / "out" / FOLDER).exists()


@pytest.mark.slow
def test_a_budget_is_that_of_all_processes(tmp_path: Path) -> None:
    many = PAIR | {"d": {"start": 0.05, "stop": 0.5, "num": 2000}, "tol": 1}
    begin = time.monotonic()
    found = pairsim.curve(many, folder=tmp_path / "out", workers=2, budget="4s")
    assert (found.status, found.reason) == ("failed", "budget")
    assert time.monotonic() - begin < PATIENCE
    assert len(found.table) < 2000
    assert not (tmp_path / "out" / FOLDER).exists()


def returned[T](solving: Generator[Any, None, T]) -> T:
    """What a generator returns at its end."""
    while True:
        try:
            next(solving)
        except StopIteration as end:
            value: T = end.value
            return value


def ranges_of(table: Path) -> set[bool]:
    """The halves of its distances in which a curve has points."""
    with suppress(ValueError, IndexError):
        return {float(line.split(",")[0]) < 0.15 for line in table.read_text().splitlines()[1:]}
    return set()


def test_a_run_is_computed_on_one_core() -> None:
    run = PAIR | {"d0": 0.1, "time": {"end": 0.01}}
    with pytest.raises(InputError, match="workers: got 2; must be 1: a run is computed on one core"):
        pairsim.run(run, workers=2)


def test_an_executor_asks_for_more_than_one_process() -> None:
    with ThreadPoolExecutor(1) as threads, pytest.raises(InputError, match="must be 2 or more with an executor"):
        pairsim.curve(CURVE, executor=threads)
    with pytest.raises(InputError, match="must be a whole number of at least 1"):
        pairsim.curve(CURVE, workers=0)

"""Cases in child processes: their outcomes, sequences of curves, and forms compiled beforehand."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from support.commands import Pairsim, words_of
from support.inputs import TINY

from pairsim.commands import COMMANDS
from pairsim.drivers.progress import Reporter
from pairsim.fem.compilation.jit import UNFINISHED
from pairsim.runtime.child_process import Child, descendants, module_command
from pairsim.sweeps.case import SweepCase
from pairsim.sweeps.grid import read_grid
from pairsim.sweeps.sweep import _compile_forms
from pairsim.sweeps.worker import CaseWorker, Result

CURVES = "command: curve\n" + TINY.replace("Ca_e: 0, ", "d: [0.15], ").replace(", time: {end: 0.01}", "")
CURVES = CURVES.replace("Np: 8", "Np: 8, max_size: 0.3")
"""The base of grids of curves of one point that take a second."""


@pytest.mark.slow
def test_sequence_of_curves_survives_its_process(tmp_path: Path) -> None:
    """Each curve starts from the previous one; if the process dies, its curve fails and the others are computed."""
    worker, tasks = curves(tmp_path, "0.02, 0.04, 0.06, 0.08", De=0.25)
    results = ends(worker, 4, 2, lambda: os.kill(process(), signal.SIGKILL))
    assert [result.folder for result in results] == [task.folder for task in tasks]
    assert [result.status for result in results] == ["finished", "finished", "failed", "finished"]
    first, second = (json.loads((tmp_path / task.folder / "run.json").read_text()) for task in tasks[:2])
    assert second["newton_iterations"] < first["newton_iterations"]
    alone = tmp_path / "alone"
    cold = module_command(
        "pairsim", "curve", str(tmp_path / "cases" / f"{tasks[1].folder}.yaml"), "-o", str(alone), "-q"
    )
    subprocess.run(cold, check=True, capture_output=True, timeout=300)
    assert float(results[1].values["dU_peak"]) == pytest.approx(COMMANDS["curve"].values(alone)["dU_peak"], rel=1e-6)  # type: ignore[arg-type]


def curves(folder: Path, values: str, De: float = 0.0) -> tuple[CaseWorker, list[SweepCase]]:
    """Tiny curves at some Ca_e, in one sequence, and a worker that has not begun them."""
    return tasks_of(folder, CURVES.replace("De: 0,", f"De: {De},") + f"grid: {{Ca_e: [{values}]}}\n")


def tasks_of(folder: Path, text: str) -> tuple[CaseWorker, list[SweepCase]]:
    """The cases of a grid, and a worker that has not begun them."""
    (folder / "grid.yaml").write_text(text)
    grid = read_grid(folder / "grid.yaml")
    tasks = list(grid.cases)
    worker = CaseWorker(grid.command, folder, timeout=1000.0)
    worker.take(tasks)
    return worker, tasks


def ends(worker: CaseWorker, count: int, after: int = 0, then: Callable[[], None] | None = None) -> list[Result]:
    """The results of this number of cases; a function is called once `after` of them have ended."""
    results: list[Result] = []
    deadline = time.monotonic() + 500
    while len(results) < count:
        assert time.monotonic() < deadline
        if (result := worker.poll()) is not None:
            results.append(result)
            if then is not None and len(results) == after:
                then()
        time.sleep(0.005)
    return results


def process() -> int:
    """The process that computes them."""
    (child,) = (pid for pid in descendants(os.getpid()) if "pairsim.sweeps.case_worker" in words_of(pid))
    return child


@pytest.mark.slow
def test_runs_that_share_a_process_survive_it(tmp_path: Path) -> None:
    """If it dies, the run at hand fails; one with a checkpoint is continued, the others begin in another process."""
    worker, tasks = tasks_of(tmp_path, TINY + "grid: {d0: [0.1, 0.15, 0.2, 0.25]}\n")
    stopped = tasks[2]
    alone = module_command("pairsim", "run", str(tmp_path / "alone.yaml"), "-o", str(tmp_path / stopped.folder), "-q")
    earlier = {**stopped.resolved, "time": {**stopped.resolved["time"], "end": 0.005}}
    (tmp_path / "alone.yaml").write_text(yaml.safe_dump(earlier))
    subprocess.run(alone, check=True, capture_output=True, timeout=300)
    results = ends(worker, 4, 1, lambda: os.kill(process(), signal.SIGKILL))
    assert [result.folder for result in results] == [task.folder for task in tasks]
    assert [result.status for result in results] == ["finished", "failed", "finished", "finished"]
    ended = [task for task, result in zip(tasks, results, strict=True) if result.status == "finished"]
    commands = [json.loads((tmp_path / task.folder / "run.json").read_text())["command"] for task in ended]
    assert ["alone.yaml" in command for command in commands] == [False, True, False]


@pytest.mark.slow
def test_a_process_that_has_grown_large_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script = (
        "import sys; from pairsim.sweeps import case_worker as w; w.MOST_MEMORY = 0; sys.exit(w.main(sys.argv[1:]))"
    )
    started: list[str] = []

    def command(module: str, *words: str) -> list[str]:
        started.append(module)
        return (
            [sys.executable, "-c", script, *words]
            if module.endswith("case_worker")
            else [*module_command(module, *words)]
        )

    monkeypatch.setattr("pairsim.sweeps.worker.module_command", command)
    worker, _ = tasks_of(tmp_path, TINY + "grid: {d0: [0.1, 0.2]}\n")
    assert [result.status for result in ends(worker, 2)] == ["finished"] * 2
    assert started == ["pairsim.sweeps.case_worker", "pairsim"]


@pytest.mark.slow
def test_a_timeout_that_comes_as_a_curve_ends_is_not_the_next_ones(tmp_path: Path) -> None:
    """The case that timed out has finished nevertheless; the next one is started again."""
    worker, tasks = curves(tmp_path, "0.02, 0.04")

    def stop() -> None:
        worker._stopped = "timeout"
        os.kill(process(), signal.SIGTERM)

    results = ends(worker, 2, 1, stop)
    assert [(result.folder, result.status) for result in results] == [(task.folder, "finished") for task in tasks]


@pytest.mark.slow
def test_what_befalls_a_case_after_it_has_said_that_it_finished_does_not_matter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The exit code of a process that is killed between run.json and its end is not that of the case."""
    worker, _ = curves(tmp_path, "0.02")
    poll = Child.poll
    monkeypatch.setattr(Child, "poll", lambda child: -9 if poll(child) == 0 else poll(child))
    (result,) = ends(worker, 1)
    assert (result.status, result.reason) == ("finished", "end")


def test_child_that_ignores_a_signal_is_killed() -> None:
    deaf = "import signal, sys, time; signal.signal(15, signal.SIG_IGN); print('deaf', file=sys.stderr); time.sleep(60)"
    child = Child([sys.executable, "-u", "-c", deaf])
    while "deaf" not in child.stderr:
        assert child.poll() is None
        time.sleep(0.02)
    child.ask_to_stop(grace=0.2)
    deadline = time.monotonic() + 50
    while (code := child.poll()) is None and time.monotonic() < deadline:
        time.sleep(0.02)
    assert code == -signal.SIGKILL


def test_child_dies_with_its_parent() -> None:
    lines = "child = Child(['sleep', '60']); print(child.pid, flush=True); os.kill(os.getpid(), 9)"
    parent = [sys.executable, "-c", f"import os; from pairsim.runtime.child_process import Child; {lines}"]
    pid = int(subprocess.run(parent, capture_output=True, text=True, check=False).stdout)
    deadline = time.monotonic() + 30
    while "sleep" in words_of(pid):
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.slow
def test_warming_up_compiles_all_that_a_case_needs_after_a_killed_compilation(tmp_path: Path) -> None:
    """What a killed process has begun is not in the cache, and what is there after another one is all of it."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    kinds = ["newtonian:moving", "neo-hookean", "newtonian:moving:enriched", "neo-hookean:enriched"]
    forms = module_command("pairsim.fem.form_cache", *kinds)

    def modules() -> set[Path]:
        return {path for path in (tmp_path / "cache").rglob("form-*") if not path.parent.name.startswith(UNFINISHED)}

    warming = subprocess.Popen(forms, env=environment)
    while warming.poll() is None and not list((tmp_path / "cache").rglob("libffcx*.c")):
        time.sleep(0.01)
    warming.kill()
    warming.wait()
    assert list((tmp_path / "cache").rglob("libffcx*.c"))
    assert not modules()
    subprocess.run(forms, env=environment, check=True, timeout=600)
    compiled = modules()
    assert len(compiled) == 6
    assert all(list(path.glob("*.so")) and list(path.glob("*.c.cached")) for path in compiled)
    (tmp_path / "case.yaml").write_text(TINY.partition(": ")[2].replace("Ca_e: 0", "Ca_e: 0.1, d0: 0.1"))
    run = module_command("pairsim", "run", "case.yaml", "-q")
    subprocess.run(run, cwd=tmp_path, env=environment, check=True, capture_output=True)
    assert modules() == compiled
    known = (
        "import sys; from pairsim.fem.form_cache import compile_missing; compile_missing(sys.argv[1:]); "
        "assert 'dolfinx' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", known, *kinds], env=environment, check=True)  # by its stamps


@pytest.mark.slow
@pytest.mark.parametrize("grid", [TINY + "grid: {d0: [0.1, 0.2]}\n", CURVES + "grid: {Ca_e: [0.02, 0.04]}\n"])
def test_cases_do_not_import_what_lies_in_the_current_folder(
    grid: str, decoys: Path, tmp_path: Path, pairsim_apart: Pairsim
) -> None:
    """Runs, and curves in a sequence; above a clone of the project, its folder would be taken for the package."""
    (tmp_path / "grid.yaml").write_text(grid)
    done = pairsim_apart("sweep", "grid.yaml", "-o", "out", "-q")
    assert done.returncode == 0, done.stderr
    cases = json.loads((tmp_path / "out" / "sweep.json").read_text())["cases"]
    assert [case["status"] for case in cases] == ["finished", "finished"]
    assert not decoys.exists()


def test_compiling_forms_does_not_import_what_lies_in_the_current_folder(
    decoys: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pairsim.fem.form_cache.missing", lambda forms: list(forms))
    notes: list[str] = []
    reporter = Reporter()
    monkeypatch.setattr(reporter, "note", notes.append)
    _compile_forms(("newtonian:moving",), None, reporter)
    assert notes == ["compiling newtonian:moving"], "and no failure"
    assert not decoys.exists()

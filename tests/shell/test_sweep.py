"""`pairsim sweep`: tables on all executors, isolated failures, restarts after any kind of end, pictures."""

from __future__ import annotations

import csv
import json
import os
import random
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.commands import Pairsim, descendants, words_of
from support.inputs import ROOT, SMALL, TINY
from support.pictures import colours
from support.result_folders import make_sweep
from typer.testing import CliRunner

import pairsim as package
from pairsim.app.command_line import app
from pairsim.record.record import Record
from pairsim.runtime import child
from pairsim.runtime.child_process import module_command
from pairsim.runtime.errors import InputError
from pairsim.solvers.nonlinear.newton import TRANSIENT
from pairsim.sweeps import task
from pairsim.sweeps.folder import STOP, read_sweep
from pairsim.sweeps.grid import read_grid
from pairsim.sweeps.sweep_plots import plot_sweep

THREE = TINY + "grid: {d0: [0.1, 0.2], beta: [0.4, 0.3]}\nexclude: [{d0: 0.1, beta: 0.3}]\n"
FATES = {1: "out_of_memory", 2: "case_timeout", 3: "error"}
ENDLESS = TINY.replace("time: {end: 0.01}", "time: {end: 500, max_step: 0.001}") + "grid: {d0: [0.1, 0.2, 0.3]}\n"
CURVES = f"command: curve\nbase: {{{SMALL}, d: [0.15], tol: 1}}\n".replace("Ca_e: 0, ", "")
LAWS = """\
import os, signal, sys, time
from dataclasses import dataclass

from pairsim.laws import ViscousLaw, parameter

@dataclass(frozen=True)
class Doom(ViscousLaw):
    name, label, words = "doom", "doom", "ends the process that computes it"

    fate: int = parameter("fate", "what befalls it", 0, 3)

    def __post_init__(self):
        if any("pairsim.computing.child" in word for word in sys.orig_argv):
            if self.fate == 1:
                os.kill(os.getpid(), signal.SIGKILL)
            if self.fate == 2:
                time.sleep(1000)
            raise RuntimeError("a fault")

    def viscosity(self, gamma2):
        return 1.0
"""
PAGE = (ROOT / "docs" / "how-to" / "cluster.md").read_text()


def command(*arguments: str, ranks: int = 0) -> list[str]:
    mpirun = [str(Path(sys.executable).parent / "mpirun"), "-n", str(ranks)] if ranks else []
    return [*mpirun, *module_command("pairsim", "sweep", "grid.yaml", "-o", "out", "-q", *arguments)]


def rows_of(folder: Path) -> list[dict[str, str]]:
    """Rows of results.csv without the wall time, the only value that is not reproducible."""
    with (folder / "results.csv").open() as file:
        return [{key: value for key, value in row.items() if key != "wall_time"} for row in csv.DictReader(file)]


def records(folder: Path) -> dict[str, str]:
    return {path.parent.name: path.read_text() for path in folder.glob("*/run.json")}


def counts(folder: Path) -> dict[str, int]:
    return {status: count for status, count in read_sweep(folder).counts.items() if count}


def doomed(*fates: int) -> str:
    """A case that ends, one of each fate, and one that ends."""
    cases = ["{d0: 0.1}", *(f"{{d0: 0.1, liquid: {{law: doom, fate: {fate}}}}}" for fate in fates), "{d0: 0.2}"]
    return TINY + "cases:\n" + "".join(f"- {case}\n" for case in cases)


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three cases, one after another."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "grid.yaml").write_text(THREE)
    assert package.sweep(folder / "grid.yaml", folder=folder / "out").status == "finished"
    return folder


@pytest.fixture
def hangup() -> Iterator[None]:
    """SIGHUP ends processes that are started meanwhile, also where nohup has started the tests."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.slow
def test_table_has_a_row_a_case_and_the_promised_columns(swept: Path) -> None:
    rows = rows_of(swept / "out")
    assert ",".join(rows[0]) == (
        "folder,status,reason,d0,beta,De,Ca_e,t,z_L,z_T,d,dU,dU_error,U_L,U_T,D_L,D_T,dp,steps,unknowns,warnings"
    )
    assert [(row["d0"], row["beta"]) for row in rows] == [("0.1", "0.4"), ("0.2", "0.4"), ("0.2", "0.3")]
    for row in rows:
        assert (row["status"], row["reason"], row["t"]) == ("finished", "end", "0.01")
        series = (swept / "out" / row["folder"] / "series.csv").read_text().splitlines()
        last = dict(zip(series[0].split(","), series[-1].split(","), strict=True))
        assert all(last[name] == row[name] for name in ("d", "dU", "U_L", "U_T", "D_L", "D_T", "dp"))
    assert {"versions", "machine", "command_line"} <= set(json.loads((swept / "out" / "sweep.json").read_text()))


@pytest.mark.slow
@pytest.mark.parametrize(("how", "fates"), [("threads", (1, 2, 3)), ("mpirun", (1, 3)), ("dask", (1, 3))])
def test_a_case_that_is_killed_hangs_or_raises_costs_itself_alone(
    how: str, fates: tuple[int, ...], swept: Path, tmp_path: Path
) -> None:
    """On every executor; the other rows are the same to the last digit. A task by itself waits for one that hangs."""
    (tmp_path / "grid.yaml").write_text(doomed(*fates))
    (tmp_path / "laws.py").write_text(LAWS)
    script = re.search(r'```python title="dask_sweep.py"\n(.*?)```', PAGE, re.DOTALL)
    assert script is not None
    (tmp_path / "dask_sweep.py").write_text(script[1])
    took = [Record.read(path.parent).wall_time for path in swept.glob("out/*/run.json")]
    enough = 4 + 4 * max(took)  # also on a crowded machine
    words = {
        "threads": command("--workers", "2", "--case-timeout", f"{enough}"),
        "mpirun": command(ranks=2),
        "dask": [sys.executable, "dask_sweep.py"],
    }[how]
    environment = os.environ | {"PAIRSIM_LAWS": str(tmp_path / "laws.py")}
    done = subprocess.run(
        words, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=800, check=False
    )
    assert done.returncode == (0 if how == "dask" else 3), done.stderr
    rows = rows_of(tmp_path / "out")
    ends = ["end", *(FATES[fate] for fate in fates), "end"]
    assert [row["reason"] for row in rows] == ends
    assert [row["status"] for row in rows] == ["finished" if end == "end" else "failed" for end in ends]
    for good, alone in zip((rows[0], rows[-1]), rows_of(swept / "out")[:2], strict=True):
        assert alone.items() <= good.items()
    assert "a fault" in Record.read(tmp_path / "out" / rows[-2]["folder"]).message
    assert how != "mpirun" or "2 of 4 cases finished, 2 failed" in done.stderr


@pytest.mark.slow
def test_a_worker_need_not_know_the_laws_of_a_case(tmp_path: Path) -> None:
    """A task that is sent to another machine takes the files of the laws along, for its child process."""
    (tmp_path / "grid.yaml").write_text(doomed(1, 2, 3))
    (tmp_path / "laws.py").write_text(LAWS)
    send = """
import pickle
from concurrent.futures import Executor, Future

import pairsim
from pairsim.sweeps.folder import CaseState

class Sender(Executor):
    def submit(self, function, task):
        with open("tasks", "ab") as file:
            pickle.dump((function, task), file)
        future = Future()
        future.set_result(CaseState(task.folder.name))
        return future

pairsim.sweep("grid.yaml", folder="out", executor=Sender())
"""
    laws = os.environ | {"PAIRSIM_LAWS": str(tmp_path / "laws.py")}
    subprocess.run([sys.executable, "-c", send], cwd=tmp_path, env=laws, check=True)
    receive = """
import pickle

with open("tasks", "rb") as file:
    for _ in range(5):
        function, task = pickle.load(file)
        print(task.environment["PAIRSIM_LAWS"])
"""
    done = subprocess.run([sys.executable, "-c", receive], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == 5 * [str(tmp_path / "laws.py")]


@pytest.fixture
def children(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Ids of the child processes of sweeps that are started meanwhile."""
    started: list[int] = []
    begin = child.Child.__init__

    def counted(new: child.Child, environment: Any) -> None:
        begin(new, environment)
        started.append(new.process.pid)

    monkeypatch.setattr(child.Child, "__init__", counted)
    return started


@pytest.mark.slow
def test_the_same_command_repeats_failures_of_the_machine_only(tmp_path: Path, children: list[int]) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "cases: [{d0: 0.1}, {d0: 0.2}, {d0: 0.4, limits.max_steps: 2}]\n")
    result = package.sweep(tmp_path / "grid.yaml", folder=tmp_path / "out")
    assert [case.reason for case in result.cases] == ["end", "end", "max_steps"]
    assert len(children) == 1, "one after another in the same process"
    assert (result.status, result.reason) == ("failed", "max_steps")
    before, rows = records(tmp_path / "out"), rows_of(tmp_path / "out")
    killed = result.cases[1].folder
    assert killed is not None
    record = json.loads(before[killed.name]) | {"status": "failed", "reason": "out_of_memory"}
    (killed / "run.json").write_text(json.dumps(record))
    assert package.sweep(tmp_path / "grid.yaml", folder=tmp_path / "out").reason == "max_steps"
    after = records(tmp_path / "out")
    assert [name for name in before if after[name] != before[name]] == [killed.name]
    assert rows_of(tmp_path / "out") == rows
    shown = CliRunner().invoke(app, ["status", str(tmp_path / "out")]).output
    assert "2 finished, 1 failed" in shown
    assert "max_steps" in shown


def test_a_sweep_of_another_version_is_named(pairsim: Pairsim, tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(THREE)
    make_sweep(tmp_path / "out", "run", {}, [], grid="of then", versions={"pairsim": "0.2.9"})
    done = pairsim("sweep", "grid.yaml", "-o", "out")
    assert done.returncode == 2
    assert "has a sweep by pairsim 0.2.9" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kills", "ranks"), [(1, 2), *(pytest.param(10, ranks, marks=pytest.mark.long) for ranks in (0, 2))]
)
def test_a_sweep_killed_again_and_again_loses_nothing(kills: int, ranks: int, tmp_path: Path) -> None:
    """What has finished is not computed again, what has not is computed, and the table is that of no kill.

    Steps are fixed: Newton's tolerance might tip the third digit of those that are controlled. So what is left of two
    velocities of at most 2 U_av is that tolerance, in both runs.
    """
    distances = f"{{start: 0.1, stop: 0.4, num: {max(kills, 2)}}}"
    fixed = TINY.replace("end: 0.01", "end: 0.01, fixed_step: 0.0005")
    (tmp_path / "grid.yaml").write_text(fixed + f"grid: {{d0: {distances}, Ca_e: [0, 0.05]}}\n")
    out, chance = tmp_path / "out", random.Random(ranks)
    finished: dict[str, str] = {}
    words = command(*(() if ranks else ("--workers", "2")), ranks=ranks)
    for _ in range(kills):
        job = subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.DEVNULL, start_new_session=True)
        while sum('"finished"' in text for text in records(out).values()) <= len(finished):
            assert job.poll() is None
            time.sleep(0.01)
        time.sleep(chance.uniform(0, 0.5))
        tree = descendants(job.pid)
        os.killpg(job.pid, signal.SIGKILL)
        job.wait()
        while any("pairsim.computing.child" in words_of(pid) or "sweep" in words_of(pid) for pid in tree):
            time.sleep(0.01)
        now = {name: text for name, text in records(out).items() if '"finished"' in text}
        assert finished.items() <= now.items(), "a finished case was computed again"
        finished = now
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "out"), done.stderr
    assert finished.items() <= records(out).items()
    for row, case in zip(rows_of(out), read_grid(tmp_path / "grid.yaml").cases, strict=True):
        assert row["folder"] == case.folder
        alone = package.run(case.case).check().table.iloc[-1]
        for name in ("dU", "d", "D_L"):
            assert float(row[name]) == pytest.approx(alone[name], rel=0, abs=4 * TRANSIENT.tolerance * 2)


def test_a_finished_case_of_version_0_2_is_finished(tmp_path: Path) -> None:
    make_sweep(tmp_path, "run", {"a": {"Ca_e": 0.1}, "b": {"Ca_e": 0.2}}, ["Ca_e"])
    for name, key in (("a", {}), ("b", {"key": "another case"})):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.json").write_text(json.dumps({"kind": "run", "status": "finished", **key}))
    assert [case.state.status for case in read_sweep(tmp_path, values=False).cases] == ["finished", "pending"]


@pytest.mark.slow
@pytest.mark.usefixtures("hangup")
@pytest.mark.parametrize(("name", "ranks"), [("SIGTERM", 2), ("SIGHUP", 0)])
def test_stopped_sweep_keeps_its_cases(name: str, ranks: int, tmp_path: Path) -> None:
    """Meanwhile no other sweep may write into the folder."""
    (tmp_path / "grid.yaml").write_text(ENDLESS)
    words = command(*(() if ranks else ("--workers", "2")), ranks=ranks)
    job = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        while sum(file.read_text().count("\n") > 1 for file in tmp_path.glob("out/*/series.csv")) < 2:
            assert job.poll() is None
            time.sleep(0.02)
        with pytest.raises(InputError, match="another command is at work in this folder"):
            package.sweep(tmp_path / "grid.yaml", folder=tmp_path / "out")
        assert counts(tmp_path / "out") == {"running": 2, "pending": 1}
        job.send_signal(signal.Signals[name])
        _, complaint = job.communicate(timeout=200)
    finally:
        job.kill()  # the cases are endless
    assert job.returncode == 130, complaint
    assert f"{name}; 0 of 3 cases finished, 3 to do" in complaint
    assert counts(tmp_path / "out") == {"pending": 3}
    assert [json.loads(text)["status"] for text in records(tmp_path / "out").values()] == ["interrupted"] * 2
    assert len(list(tmp_path.glob("out/*/checkpoint.npz"))) == 2


@pytest.mark.usefixtures("hangup")
def test_nohup_is_heeded_and_mpi_leaves_sighup_alone_and_nothing_behind() -> None:
    """UCX, which comes with MPICH, would catch the signal, also where nohup ignores it."""
    program = (
        "import signal; from pairsim.runtime.mpi import MPI; from pairsim.runtime.signals import Signals\n"
        "with Signals() as signals:\n    signal.raise_signal(signal.SIGHUP)\n    print(int(signals.number))"
    )
    alone = [sys.executable, "-c", program]
    done = [subprocess.run(words, capture_output=True, text=True, check=True) for words in (alone, ["nohup", *alone])]
    assert [each.stdout.strip() for each in done] == [str(int(signal.SIGHUP)), "0"]
    bare = "import os, signal; from pairsim.runtime.mpi import MPI; os.kill(os.getpid(), signal.SIGHUP)"
    process = subprocess.Popen([sys.executable, "-c", bare])
    assert process.wait() == -signal.SIGHUP
    assert not list(Path("/dev/shm").glob(f"*_{process.pid:x}_*")), "memory that MPI would share"


@pytest.mark.slow
def test_a_child_that_has_grown_large_is_replaced(
    tmp_path: Path, children: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(task, "MOST_MEMORY", 0.0)
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1, 0.2]}\n")
    assert package.sweep(tmp_path / "grid.yaml", folder=tmp_path / "out").status == "finished"
    assert len(children) == 2


def test_a_case_that_is_stopped_while_its_child_is_loading_is_pending(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where SIGTERM is ignored, as in all but the first of the processes of mpirun."""
    monkeypatch.setattr(child, "POLL", 0.01)
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        stopping = threading.Timer(0.2, (tmp_path / STOP).touch)
        stopping.start()
        state = task.compute(task.Task(tmp_path / "case", "run", "key", b"", "pairsim sweep", None, {}, {}))
    finally:
        signal.signal(signal.SIGTERM, before)
    assert state.status == "pending"


def test_a_case_that_is_stopped_before_it_begins_is_pending_also_if_it_had_failed(tmp_path: Path) -> None:
    (tmp_path / "case").mkdir()
    failed = Record({"kind": "run", "key": "key", "status": "failed", "reason": "environment"})
    failed.write(tmp_path / "case")
    (tmp_path / STOP).touch()
    state = task.compute(task.Task(tmp_path / "case", "run", "key", b"", "pairsim sweep", None, {}, {}))
    assert state.status == "pending"


def test_a_child_that_is_killed_while_it_is_loading_costs_its_case_alone(
    tmp_path: Path, children: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A failure with the reason `environment` would stop the sweep."""
    monkeypatch.setattr(child, "POLL", 0.01)

    def kill() -> None:
        while not children:
            time.sleep(0.001)
        time.sleep(0.3)
        os.kill(children[0], signal.SIGKILL)

    killing = threading.Thread(target=kill)
    killing.start()
    state = task.compute(task.Task(tmp_path / "case", "run", "key", b"", "pairsim sweep", None, {}, {}))
    killing.join()
    assert (state.status, state.reason) == ("failed", "out_of_memory")


def test_a_sweep_whose_folder_is_removed_stops_and_says_so(tmp_path: Path) -> None:
    """Before, the remaining cases were computed into a new folder, which no command accepts as that of a sweep."""
    (tmp_path / "grid.yaml").write_text(ENDLESS)
    process = subprocess.Popen(command(), cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    while not list(tmp_path.glob("out/*/series.csv")):
        time.sleep(0.05)
    (tmp_path / "out").rename(tmp_path / "moved")
    assert "out was removed or moved while its cases were computed" in process.communicate(timeout=300)[1]
    assert process.returncode == 4
    assert not (tmp_path / "out").exists()
    assert counts(tmp_path / "moved") == {"pending": 3}


@pytest.mark.slow
def test_a_sweep_needs_no_standard_streams(tmp_path: Path) -> None:
    """As under a daemon that has closed them: files and pipes must not take their descriptors."""
    (tmp_path / "grid.yaml").write_text(TINY + "cases: [{d0: 0.1}]\n")
    closed = ["sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh"]
    done = subprocess.run([*closed, *command()], cwd=tmp_path, timeout=300, check=False)
    assert (done.returncode, counts(tmp_path / "out")) == (0, {"finished": 1})
    shown = subprocess.run(
        [*closed, *module_command("pairsim", "table", "out")], cwd=tmp_path, timeout=300, check=False
    )
    assert shown.returncode == 0


@pytest.mark.slow
def test_curves_are_swept_too(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """results.csv has points, zeros and peak of every curve, as in its folder; pictures are drawn.

    A curve whose steady states end before its first point is finished, too.
    """
    (tmp_path / "grid.yaml").write_text(CURVES.replace("[0.15]", "[0.1, 0.3]") + "grid: {Ca_e: [0, 0.05, 0.4]}\n")
    result = package.sweep(tmp_path / "grid.yaml", folder=tmp_path / "out", workers=2)
    assert result.status == "finished"
    assert capfd.readouterr() == ("", "")
    assert package.open(tmp_path / "out").table.equals(result.table)
    assert ",".join(name for name in result.table if name != "wall_time") == (
        "folder,status,reason,Ca_e,beta,De,points,zeros,zeros_error,stable,d_peak,d_peak_error,dU_peak,dU_error,"
        "unknowns,warnings"
    )
    rigid, soft, softest = (row for _, row in result.table.iterrows())
    assert (softest["status"], softest["reason"]) == ("finished", "no_steady_state")
    assert (soft["status"], soft["points"], soft["zeros"], soft["stable"]) == ("finished", 3, [], [])
    curve = result.cases[1]
    points = curve.table.loc[curve.table["dU"].idxmax()]
    assert soft["dU_peak"] == pytest.approx(curve.dU(soft["d_peak"]), rel=1e-9)
    assert 0 <= soft["dU_peak"] - points["dU"] < soft["dU_error"]
    assert soft["dU_error"] > points["dU_error"] * (1 - 1e-9)
    assert abs(soft["d_peak"] - points["d"]) <= soft["d_peak_error"]
    assert abs(rigid["dU_peak"]) < 1e-9 < soft["dU_peak"]
    assert plot_sweep(tmp_path / "out") == [tmp_path / "out" / "sweep_curves.png"], "there is no zero to draw"


def test_pictures_of_critical_distances_show_the_zeros(tmp_path: Path) -> None:
    def drawn(
        name: str, cases: dict[tuple[float, float], str], varying: list[str], command: str = "critical"
    ) -> list[str]:
        """The pictures of a sweep of searches over Ca_e and De that found one zero or none."""
        folder = tmp_path / name
        for (Ca_e, De), zeros in cases.items():
            case = folder / f"{Ca_e}-{De}"
            case.mkdir(parents=True)
            (case / "run.json").write_text('{"status": "finished", "reason": "end"}')
            (case / "critical.csv").write_text(f"kind,d_cr,d_error,stable,Ca_e,De\n{zeros}")
        parameters = {f"{Ca_e}-{De}": {"Ca_e": Ca_e, "De": De} for Ca_e, De in cases}
        return [path.name for path in plot_sweep(make_sweep(folder, command, parameters, varying))]

    few = {(0.1, 0.25): "wanted,0.18,0.01,false,0.1,0.25\n", (0.02, 0.25): "wanted,0.25,0.01,false,0.02,0.25\n"}
    few[0.1, 0.0] = "end,0.3,0.01,true,0.1,0\n"
    assert drawn("few", few, ["Ca_e", "De"]) == ["sweep_zeros.png"]
    with pytest.raises(InputError, match="no zero of dU"):
        drawn("none", {(0.1, 0.0): few[0.1, 0.0]}, ["Ca_e"])
    with pytest.raises(InputError, match="`pairsim shape`, which has pictures only in the folders of its cases"):
        drawn("shapes", {(0.1, 0.0): ""}, ["Ca_e"], "shape")


@pytest.mark.slow
def test_pictures_of_a_sweep(swept: Path, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["plot", str(swept / "out"), "-o", str(tmp_path / "pictures"), "--group", "beta"])
    assert done.exit_code == 0, done.output
    names = ["sweep_series.png", "sweep_parameters.png"]
    assert [Path(line).name for line in done.output.split()] == names
    for name in names:
        assert colours(tmp_path / "pictures" / name) > 50
    with pytest.raises(InputError, match="a parameter that varies: d0, beta"):
        plot_sweep(swept / "out", tmp_path, "xi")


@pytest.mark.slow
def test_cases_do_not_import_what_lies_in_the_current_folder(tmp_path: Path, pairsim_apart: Pairsim) -> None:
    """Above a clone of the project, its folder would be taken for the package."""
    (tmp_path / "pairsim").mkdir()
    for name in ("yaml", "numpy", "pydantic"):
        (tmp_path / f"{name}.py").write_text("raise ImportError('a decoy')\n")
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1]}\n")
    done = pairsim_apart("sweep", "grid.yaml", "-o", "out", "-q")
    assert done.returncode == 0, done.stderr
    assert counts(tmp_path / "out") == {"finished": 1}


def test_dry_run_lists_all_cases_and_computes_none(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1, 0.2, 0.2]}\n")
    result = CliRunner().invoke(app, ["sweep", str(tmp_path / "grid.yaml"), "-o", str(tmp_path / "out"), "--dry-run"])
    assert result.exit_code == 0
    assert "2 cases of pairsim run" in result.output
    assert "1 duplicate left out" in result.output
    assert all(case.folder in result.output for case in read_grid(tmp_path / "grid.yaml").cases)
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_duplicates_are_computed_once_and_said(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1, 0.1000000000000001]}\n")
    done = pairsim("sweep", "grid.yaml", "-o", "out", "-q")
    assert "1 of 1 cases finished, 1 duplicate left out" in done.stderr

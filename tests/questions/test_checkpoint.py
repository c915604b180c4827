"""A stopped run resumes from its checkpoint; its results are those of an uninterrupted one to Newton's tolerance."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.commands import Pairsim
from support.scenes import dU, soft_pair

import pairsim
from pairsim.cases.run_case import Case
from pairsim.computing.progress import Reporter
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics import solids
from pairsim.record.checkpoint import Checkpoint, load
from pairsim.record.folder import write_bytes
from pairsim.record.table_files import read_table
from pairsim.record.xdmf import read_times
from pairsim.runtime.errors import InputError
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.adaptation import RunAdaptation
from pairsim.solvers.transient.transient import Transient

SOFT: dict[str, Any] = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "ends": "developed", "length": 3}
SOFT |= {"mesh": {"Np": 8, "max_size": 0.15}, "time": {"end": 0.02, "first_step": 0.001}, "output": {"every": 0.004}}


class Stops(Reporter):
    """Sends the run a signal after a step, and keeps its messages."""

    def __init__(self, after: int | None = None) -> None:
        super().__init__()
        self.after, self.messages = after, ""

    def update(self, done: float, text: str, count: int) -> None:
        if count == self.after:
            signal.raise_signal(signal.SIGTERM)

    def note(self, text: str) -> None:
        self.messages += text

    def finish(self, text: str) -> None:
        self.messages += text


def soft(**changes: Any) -> Case:
    return pairsim.load({**SOFT, **changes})


def run(case: Case, folder: Path, reporter: Reporter | None = None, *, resume: bool = False) -> pairsim.RunResult:
    """Run or continue a case with the signal handlers of the command line; messages go to the reporter."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pairsim.questions.compute.Reporter", lambda *_: reporter or Reporter())
        return pairsim.run(case, folder=folder, resume=resume, signals=True)


def assert_close(whole: Path, resumed: Path) -> None:
    """At output times the rows of two runs agree.

    Newton's tolerance is felt by step sizes, in their third digit, and by dU_correction, for which a few iterations are
    made with the factors in hand. Resumed after any of their steps, the cases of this file differed by 3e-6 of the
    largest dU_discrete and by 0.7 dU_error (8e-5 and 0.4 after the second step).
    """
    a, b = read_table(whole / "series.csv"), read_table(resumed / "series.csv")
    assert list(a) == list(b)
    assert len(a["t"]) == pytest.approx(len(b["t"]), abs=1)
    times = np.array([0.004, 0.008, 0.012, 0.016, 0.02])
    at, there = (np.abs(each["t"][:, None] - times).argmin(axis=0) for each in (a, b))
    assert a["t"][at] == pytest.approx(times, rel=1e-9)
    assert b["t"][there] == pytest.approx(times, rel=1e-9)
    discrete = "dU_discrete" if "dU_discrete" in a else "dU"
    for name in ("d", discrete, "D_L", "D_T", "dp"):
        assert np.abs(a[name][at] - b[name][there]).max() <= 2e-5 * np.abs(a[name]).max(), name
    if "dU_error" in a:
        assert (np.abs(a["dU"][at] - b["dU"][there]) < a["dU_error"][at]).all()
        assert np.abs(a["dU_error"][at] - b["dU_error"][there]).max() < 0.8 * a["dU_error"].max()


VISCOELASTIC = pytest.param({"De": 1, "start": "steady"}, marks=pytest.mark.slow)


@pytest.fixture(scope="module", params=[{}, VISCOELASTIC], ids=["newtonian", "viscoelastic, steady start"])
def stopped(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Case, Path, Path]:
    """A case, the folder of an uninterrupted run, and that of a run stopped after six steps and resumed."""
    base, case = tmp_path_factory.mktemp("runs"), soft(**request.param, dU_error=True)
    assert run(case, base / "whole").status == "finished"
    assert run(case, base / "cut", Stops(6)).status == "interrupted"
    assert len(read_table(base / "cut" / "series.csv")["t"]) == 6
    with (base / "cut" / "series.csv").open("a") as file:
        file.write((base / "cut" / "series.csv").read_text().splitlines()[-1] + "\n0.1,0.2")  # beyond the checkpoint
    show = Stops()
    assert run(case, base / "cut", show, resume=True).status == "finished"
    assert "resuming from t = " in show.messages
    assert "(step 6)" in show.messages
    return case, base / "whole", base / "cut"


def test_a_continued_run_is_the_uninterrupted_one(stopped: tuple[Case, Path, Path]) -> None:
    """So are its frames, each once: the step at which it was stopped is no output time. The record counts both runs."""
    _, whole, cut = stopped
    assert_close(whole, cut)
    assert read_times(cut) == pytest.approx(read_times(whole))
    assert len(read_times(cut)) == 6  # the first step and five output times
    assert (cut / "fields.xdmf").read_text() == (whole / "fields.xdmf").read_text()
    a, b = (json.loads((folder / "run.json").read_text()) for folder in (whole, cut))
    for name in ("status", "reason", "t", "rejected_steps", "remeshings", "unknowns"):
        assert a[name] == b[name], name
    assert b["steps"] == len(read_table(cut / "series.csv")["t"])
    assert b["newton_iterations"] > read_table(cut / "series.csv")["newton"].sum() - 1
    assert sum(b["wall_time_by_phase"].values()) == pytest.approx(b["wall_time"], rel=1e-6)


def test_a_finished_run_has_nothing_to_do(stopped: tuple[Case, Path, Path]) -> None:
    case, _, cut = stopped
    before = {path: path.read_bytes() for path in cut.rglob("*.*")}
    show = Stops()
    assert run(case, cut, show, resume=True).status == "finished"
    assert show.messages.startswith("nothing to do: finished at t = 0.02")
    assert {path: path.read_bytes() for path in cut.rglob("*.*")} == before


def test_end_of_a_killed_run_is_recorded_at_resume(stopped: tuple[Case, Path, Path]) -> None:
    """A run killed between its last checkpoint and run.json: resuming completes run.json and the warnings."""
    case, _, cut = stopped
    before = json.loads((cut / "run.json").read_text())
    (cut / "run.json").write_text(json.dumps({"status": "running"}))
    rows, frames = (cut / "series.csv").read_bytes(), read_times(cut)
    run(case, cut, resume=True)
    after = json.loads((cut / "run.json").read_text())
    measured = ("started", "wall_time", "wall_time_by_phase", "peak_memory")
    assert before.keys() == after.keys()
    assert {k: v for k, v in after.items() if k not in measured} == {
        k: v for k, v in before.items() if k not in measured
    }
    assert (cut / "series.csv").read_bytes() == rows
    assert np.array_equal(read_times(cut), frames)


@pytest.mark.slow
def test_run_can_be_resumed_from_any_step(tmp_path: Path) -> None:
    """Also before and after remeshing, around deformed particles; errors and extremes are read back exactly."""
    settings, control = MeshSettings(Np=8), StepControl(3e-4, 1e-8, 2.0, 0.05)
    problem = soft_pair(0.4, 0.1, 0.2, length=3.0, periodic=False, mesh=settings, control=control)
    problem = replace(problem, betas=(0.3, 0.4), solids=solids.soft(0.05, 0.2), dU_error=True)
    times = iter([0.8])
    transient = Transient(problem)
    steps, states = [], []
    for step in transient.steps(times):
        steps.append(step)
        states.append(transient.state)
    transient.close()
    new = next(k for k, step in enumerate(steps) if step.mesh_id)
    for k in (0, 5, *range(new - 2, new + 2), len(steps) - 3):
        Checkpoint(states[k], {}, None, 1, 1, 0.0).save(tmp_path)
        found = load(tmp_path)
        assert found is not None
        for kept, read in ((states[k].run_errors, found.state.run_errors), (states[k].extremes, found.state.extremes)):
            np.testing.assert_equal(asdict(read), asdict(kept))
        again = Transient(problem, found.state)
        try:
            for step, expected in zip(again.steps(iter([0.8])), steps[k + 1 : k + 3], strict=False):
                assert (step.t, step.mesh_id) == (expected.t, expected.mesh_id)
                assert dU(step) == pytest.approx(dU(expected), rel=1e-6), k
                for goal, error in expected.half_widths.items():
                    assert step.half_widths[goal] == pytest.approx(error, rel=0.2), (k, goal.name)
        finally:
            again.close()


@pytest.mark.slow
def test_run_can_be_resumed_with_a_later_end(tmp_path: Path) -> None:
    run(soft(time={"end": 0.008, "first_step": 0.001}), tmp_path / "run")
    first = (tmp_path / "run" / "series.csv").read_text()
    assert run(soft(), tmp_path / "run", resume=True).reason == "end"
    assert (tmp_path / "run" / "series.csv").read_text().startswith(first)
    assert read_table(tmp_path / "run" / "series.csv")["t"][-1] == pytest.approx(0.02)
    assert read_times(tmp_path / "run")[1:] == pytest.approx([0.004, 0.008, 0.012, 0.016, 0.02])
    run(soft(), tmp_path / "whole")
    assert_close(tmp_path / "whole", tmp_path / "run")  # the first end was a time of output of the whole run too


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("short") / "run"
    run(soft(limits={"max_steps": 2}), folder)
    return folder


@pytest.mark.slow
def test_a_folder_is_enough_to_resume(short: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    shutil.copytree(short, tmp_path / "run")
    done = pairsim("run", "--resume", "run", "--set", "limits.max_steps=100")
    assert (done.returncode, done.stdout.strip()) == (0, "run"), done.stderr
    assert read_table(tmp_path / "run" / "series.csv")["t"][-1] == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("changes", "key", "values"),
    [
        ({"Ca_e": 0.2}, "Ca_e", ("0.2", "0.1")),
        ({"mesh": {"Np": 10, "max_size": 0.15}}, "mesh.Np", ("10", "8")),
        ({"time": {"end": 0.02, "first_step": 0.001, "tol": 1e-3}}, "time.tol", ("0.001", "0.0003")),
    ],
)
def test_another_problem_is_refused_by_its_key(
    short: Path, changes: dict[str, Any], key: str, values: tuple[str, str]
) -> None:
    before = {path: path.read_bytes() for path in short.rglob("*.*")}
    with pytest.raises(InputError, match=values[1]) as caught:
        run(soft(**changes), short, resume=True)
    assert caught.value.key == key
    assert values[0] in str(caught.value)
    assert {path: path.read_bytes() for path in short.rglob("*.*")} == before


def flipped_in_the_middle(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("checkpoint.npz", lambda content: content[: len(content) // 2], r"checkpoint\.npz"),
        ("checkpoint.npz", flipped_in_the_middle, r"checkpoint\.npz"),
        ("series.csv", lambda content: content[: content.rindex(b"\n", 0, -1) + 1], r"series\.csv.*at least 2 rows"),
    ],
    ids=["torn", "flipped", "a row less"],
)
def test_damaged_files_are_refused(
    name: str, change: Callable[[bytes], bytes], message: str, short: Path, tmp_path: Path
) -> None:
    shutil.copytree(short, tmp_path, dirs_exist_ok=True)
    (tmp_path / name).write_bytes(change((tmp_path / name).read_bytes()))
    rows = (tmp_path / "series.csv").read_text()
    with pytest.raises(InputError, match=message):
        run(soft(), tmp_path, resume=True)
    assert (tmp_path / "series.csv").read_text() == rows


def test_without_a_checkpoint_a_run_starts_at_0_unless_rows_would_be_lost(short: Path, tmp_path: Path) -> None:
    case = soft(limits={"max_steps": 2})
    assert run(case, tmp_path / "new", resume=True).reason == "max_steps"
    (tmp_path / "new" / "checkpoint.npz").unlink()
    with pytest.raises(InputError, match=r"must have a checkpoint\.npz"):
        run(case, tmp_path / "new", resume=True)
    (tmp_path / "new" / "series.csv").unlink()
    show = Stops()
    assert run(case, tmp_path / "new", show, resume=True).reason == "max_steps"
    assert "starting at t = 0" in show.messages
    assert (tmp_path / "new" / "series.csv").read_text() == (short / "series.csv").read_text()


@pytest.mark.slow
def test_run_that_fills_the_disk_with_fields_can_be_resumed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk is full at the fourth frame."""
    case = soft(output={"every": 0.001, "checkpoint": 1000})
    run(case, tmp_path / "whole")

    def full(path: Path, content: bytes) -> None:
        if path.name >= "0003.h5":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        write_bytes(path, content)

    with monkeypatch.context() as patch:
        patch.setattr("pairsim.record.xdmf.write_bytes", full)
        result = run(case, tmp_path / "run")
    assert (result.status, result.reason) == ("failed", "write_failed")
    file = tmp_path / "run" / "fields" / "0003.h5"
    assert f"{file} cannot be written (No space left on device); try --resume once it can be" in result.message
    assert json.loads((tmp_path / "run" / "run.json").read_text())["reason"] == "write_failed"
    assert run(case, tmp_path / "run", resume=True).status == "finished"
    assert_close(tmp_path / "whole", tmp_path / "run")
    assert read_times(tmp_path / "run") == pytest.approx(read_times(tmp_path / "whole"))


@pytest.mark.slow
def test_an_adapted_run_goes_on_with_its_cells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a second coarse run."""
    case = soft(mesh={}, accuracy="5%", dU_error=True)
    assert run(case, tmp_path, Stops(6)).status == "interrupted"
    before = json.loads((tmp_path / "run.json").read_text())["adaptation"]
    monkeypatch.delattr(RunAdaptation, "begin")
    result = run(case, tmp_path, resume=True)
    assert result.record["adaptation"]["cells"] == before["cells"]
    assert result.record["adaptation"]["coarse_run"] == before["coarse_run"]
    assert "; accuracy: 5% was " in result.record["message"]

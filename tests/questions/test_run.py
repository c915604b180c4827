"""`pairsim.run`: series, fields, ends, limits, the start-up; extremes of every number."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.integrate import cumulative_trapezoid
from support.commands import Pairsim, interrupted
from support.frames import frames_everywhere
from support.inputs import CONFIGS

import pairsim
from pairsim.fem.diagnostics import extents
from pairsim.quantities.kinds import VELOCITY
from pairsim.quantities.text import in_unit, with_error
from pairsim.questions.run.ends import frames_until
from pairsim.record.table_files import read_table
from pairsim.record.xdmf import read_frame, read_times
from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.problems import Problem

SOFT: dict[str, Any] = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "mesh": {"Np": 12}, "time": {"end": 0.1}}
SOFT |= {"output": {"times": [0.02, 0.05]}}


@pytest.fixture(scope="module")
def soft_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("soft") / "out"
    pairsim.run(SOFT, folder=folder).check()
    return folder


def test_series_and_record_have_what_was_promised(soft_run: Path) -> None:
    header, *rows = (soft_run / "series.csv").read_text().splitlines()
    assert header.startswith("t,d,U_L,U_T,dU,D_L,D_T,dp,dp_plus,")
    assert max(len(value.lstrip("-0.").replace(".", "")) for value in rows[5].split(",")) >= 12
    series, record = read_table(soft_run / "series.csv"), json.loads((soft_run / "run.json").read_text())
    assert np.allclose(series["dU"], series["U_L"] - series["U_T"], atol=1e-15)
    assert np.allclose(series["dp_plus"], series["dp"] - 32 * 4.9, atol=1e-9)  # 2 D_c on each side
    for each in "LT":
        way = series[f"z_{each}"] - series[f"z_{each}"][0]
        assert way == pytest.approx(cumulative_trapezoid(series[f"U_{each}"], series["t"], initial=0), abs=2e-5)
    assert series["z_L"] - series["z_T"] == pytest.approx(series["d"] + 0.4, abs=0.01)
    assert series["z_T"][0] == pytest.approx(series["U_T"][0] * series["t"][0], rel=0.1), "from where the first started"
    assert {0.02, 0.05, 0.1} <= set(np.round(series["t"], 12))
    assert (record["status"], record["reason"], record["steps"]) == ("finished", "end", len(rows))
    assert {"mesh", "jit", "assembly", "factorisation", "solve", "output"} <= set(record["wall_time_by_phase"])
    assert sum(record["wall_time_by_phase"].values()) == pytest.approx(record["wall_time"], rel=1e-6)


def test_fields_show_the_deformed_outline(soft_run: Path) -> None:
    """D of the outline in the fields, as pyvista and meshio open them, is that of series.csv at every written time."""
    series, frames = read_table(soft_run / "series.csv"), frames_everywhere(soft_run)
    assert len(frames) == 4  # first step, two output times, the end
    for frame in frames:
        row = int(np.argmin(np.abs(series["t"] - frame.t)))
        for particle, name in ((1, "D_T"), (2, "D_L")):
            sides = [(0, 3, 1), (1, 4, 2), (2, 5, 0)]
            cells = frame.points[frame.cells[frame.region == particle]]
            z_min, z_max, r_max = np.array([extents(side) for nodes in sides for side in cells[:, nodes]]).T
            length, width = z_max.max() - z_min.min(), 2 * r_max.max()
            assert (length - width) / (length + width) == pytest.approx(series[name][row], abs=1e-12)


def test_solid_stress_is_that_of_the_shape(soft_run: Path) -> None:
    """The mean of tr(B) - 3 is not negative for an incompressible deformation, and grows with D."""
    first, frame = read_frame(soft_run, 0), read_frame(soft_run, -1)
    inside = np.unique(frame.cells[frame.region > 0])
    means = [each.point_data["tau_s"][inside][:, [0, 2, 3]].sum(axis=1).mean() for each in (first, frame)]
    assert 0 < means[0] < 0.1 * means[1]
    liquid = np.setdiff1d(np.unique(frame.cells[frame.region == 0]), inside)
    assert np.all(frame.point_data["tau_s"][liquid] == 0)


def test_pressure_less_that_without_particles_drops_by_dp_plus(soft_run: Path) -> None:
    frame, series = read_frame(soft_run), read_table(soft_run / "series.csv")
    assert np.linalg.norm(frame.point_data["velocity"], axis=1).max() == pytest.approx(2, rel=0.1), "as of Poiseuille"
    z, extra = frame.points[:, 0], frame.point_data["pressure_extra"]
    ends = [extra[np.abs(z - end) < 1e-9].mean() for end in (z.min(), z.max())]
    assert ends[0] - ends[1] == pytest.approx(series["dp_plus"][-1], rel=1e-4)


@pytest.mark.slow
def test_frames_are_written_at_steps_as_they_come(tmp_path: Path) -> None:
    """About as many as asked for, spread over the run, without a step that is there for them."""
    small = SOFT | {"length": 4, "mesh": {"Np": 8}, "time": {"end": 0.1, "first_step": 0.001}}
    for name, frames in (("some", 6), ("none", 0)):
        pairsim.run(small, output={"times": [], "frames": frames}, folder=tmp_path / name).check()
    some, none = (read_table(tmp_path / name / "series.csv")["t"] for name in ("some", "none"))
    assert np.array_equal(some, none)
    assert len(read_times(tmp_path / "none")) == 2
    due = [min(t for t in some if t >= 0.1 * k / 6 - 1e-12) for k in range(1, 7)]
    assert list(read_times(tmp_path / "some")) == sorted({some[0], *due})


def test_as_many_frames_are_due_where_a_run_ends_before_its_time() -> None:
    """Those of a row whose first gap closes, at a time of one hundredth of the end, and of a pair that moves off."""
    row = pairsim.load(SOFT | {"particles": 3, "d0": [0.1, 0.3], "time": {"end": 50.0}, "output": {}}, kind="run")
    counts = [frames_until(row, t, (0.1 - 0.196 * t, 0.3 + t / 10)) for t in np.linspace(0, 0.5, 40)]
    assert (counts[0], counts[-1]) == (0, 20)
    assert set(np.diff(counts)) <= {0, 1}
    pair = pairsim.load(SOFT | {"time": {"end": 50.0}, "limits": {"max_gap": 0.2}, "output": {}}, kind="run")
    assert [frames_until(pair, t, (0.1 + t / 10,)) for t in (0.0, 0.25, 0.5, 1.0)] == [0, 5, 10, 20]


@pytest.mark.slow
def test_several_processes_for_one_case_are_refused_once(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(SOFT))
    done = pairsim("run", "case.yaml", "-o", "out", ranks=2)
    assert done.returncode == 2
    assert done.stderr.count("one process computes a case, but 2 were started") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("ends", ["periodic", "developed"])
def test_poiseuille_flow_is_exact(ends: str) -> None:
    series = pairsim.run({"particles": 0, "De": 0, "length": 4, "ends": ends}).check().table
    assert list(series)[:3] == ["t", "dp", "dp_plus"]
    assert np.abs(series["dp"] - 32 * 4).max() < 1e-9


def test_ends_of_both_kinds_agree(soft_run: Path) -> None:
    cut = pairsim.open(soft_run).table
    long = pairsim.run(SOFT, ends="periodic").check().table
    assert abs(long["dU"].iloc[-1] - cut["dU"].iloc[-1]) < 5e-3 * long["dU"].abs().max()
    assert abs(long["dp_plus"].iloc[-1] - cut["dp_plus"].iloc[-1]) < 1e-3


def test_unequal_pair_runs_into_contact() -> None:
    """A smaller, faster rigid sphere behind a larger one catches up; the run ends by itself."""
    pair = {"beta": [0.3, 0.4], "De": 0, "Ca_e": 0, "d0": 0.1, "ends": "developed", "length": 3, "mesh": {"Np": 8}}
    result = pairsim.run(pair, time={"end": 50}, limits={"min_gap": 0.02})
    assert (result.status, result.reason) == ("finished", "contact")
    assert result.table["d"].iloc[-1] < 0.02 < result.table["d"].iloc[-2]


def test_pair_that_outgrows_its_tube_ends_typed() -> None:
    pair = {"beta": [0.4, 0.3], "De": 0, "Ca_e": 0, "d0": 0.1, "ends": "developed", "length": 1.95, "mesh": {"Np": 8}}
    result = pairsim.run(pair, time={"end": 20}, output={"fields": False})
    assert (result.status, result.reason) == ("failed", "tube_too_short")
    assert any("the ends affect dU" in warning for warning in result.warnings)
    assert result.answer.count("--set length=") == 1


def test_lone_rigid_sphere_takes_ever_larger_steps() -> None:
    sphere = {"particles": 1, "beta": 0.4, "De": 0, "Ca_e": 0, "ends": "developed", "length": 3, "mesh": {"Np": 8}}
    assert pairsim.run(sphere, time={"end": 2}).check().record["steps"] < 40


@pytest.mark.parametrize(("limits", "reason"), [({"max_steps": 3}, "max_steps"), ({"wall_time": 0.01}, "wall_time")])
def test_limits_are_typed_failures(limits: dict[str, float], reason: str) -> None:
    result = pairsim.run(SOFT, limits=limits)
    assert (result.status, result.reason) == ("failed", reason)
    assert len(result.table) >= 1


def test_step_that_cannot_be_solved_is_a_failure(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(SOFT))
    hopeless = ["--set", "time.fixed_step=0.1", "--set", "Ca_e=5", "--set", "time.end=20", "--set", "output.times=[]"]
    done = pairsim("run", "case.yaml", "-o", "out", *hopeless)
    assert done.returncode == 3, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert record["status"] == "failed"
    assert record["reason"] in ("newton_diverged", "inverted_cell", "mesh_failed", "step_too_small")
    what, _, remedy = record["message"].partition("; try ")
    assert (done.stderr.count(what), done.stderr.count(remedy)) == (1, 1), "each is said once"
    assert done.stderr.splitlines()[-1].startswith(f"Next: try {remedy}")


def test_the_answer_says_what_its_symbols_and_units_are(soft_run: Path, tmp_path: Path) -> None:
    said = pairsim.open(soft_run).answer
    assert "Without any memory of its start it would have dU = " in said
    assert "Here dU is the velocity of the leading particle minus that of the trailing one; D, the Taylor" in said
    assert "lengths are in tube diameters D_c, velocities in the mean velocity U_av, times in D_c/U_av." in said
    coarse = {"mesh": {"Np": 8, "max_size": 0.3}, "length": 3, "time": {"end": 0.001}, "output": {"fields": False}}
    beads = pairsim.run(OF_BEADS, d0=0.1, **coarse, folder=tmp_path / "beads")
    assert "Here dU is the velocity" in beads.answer
    assert "tube diameters" not in beads.answer


@pytest.mark.slow
@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: config.stem)
def test_shipped_case_runs(config: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    """On a coarse mesh for a few steps."""
    short = ("time.end=0.02", "output.times=[]", "mesh.Np=8", "accuracy=5%")
    done = pairsim("run", str(config), "-o", "out", "-q", *(word for setting in short for word in ("--set", setting)))
    assert (done.returncode, done.stdout, done.stderr) == (0, "out\n", ""), "quiet but for its folder"
    assert json.loads((tmp_path / "out" / "run.json").read_text())["status"] == "finished"


@pytest.mark.slow
def test_an_interrupted_run_keeps_its_rows(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(SOFT | {"time": {"end": 500, "max_step": 0.01}}))
    series = tmp_path / "out" / "series.csv"
    record = interrupted(["run", "case.yaml", "-o", "out"], series, signal.SIGTERM)
    assert record["steps"] == len(read_table(series)["t"]) >= 4


EXPERIMENT = {"tube": "50um", "particle": "15um", "viscosity": "0.05Pa.s", "relaxation": "20ms", "modulus": "500Pa"}
OF_BEADS: dict[str, Any] = {"physical": {**EXPERIMENT, "flow_rate": "0.5ul/min"}, "accuracy": "5%"}
FEW = {"ends": "developed", "length": "auto", "output": {"fields": False}}


@pytest.mark.long
def test_run_and_curve_give_one_answer() -> None:
    """De 1.7: the run comes closer by 2 % of the distance before it separates. At `5%` the sign of dU is open."""
    beads = {**OF_BEADS, "accuracy": "2%"}
    whole = pairsim.run(beads, **FEW, d0=0.1, start="rest")
    t, d, dU = (whole.table[name].iloc[-1] for name in ("t", "d", "dU"))
    assert t == pytest.approx(10.2)
    assert d < 0.1
    assert whole.answer.startswith("The pair separates: ")
    assert "During start-up it came closer." in whole.answer
    curve = pairsim.curve(beads, ends="developed", length="auto", d=[float(d)]).table
    assert abs(dU - curve["dU"][0]) < 2 * curve["dU_error"][0]
    assert curve["dU"][0] > curve["dU_error"][0]


@pytest.mark.slow
def test_a_soft_pair_that_starts_steady_has_no_start_up() -> None:
    keys = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "mesh": {"Np": 12}, "time": {"end": 0.2}}
    assert pairsim.run(keys, **FEW).answer.startswith("The pair is still starting up: ")
    steady = pairsim.run(keys, **FEW, start="steady")
    assert steady.answer.startswith("The pair separates: ")
    assert {"dU_error", "dU_discrete"} & set(steady.table) == {"dU_error"}
    errors = steady.table[["U_error_L", "U_error_T", "D_error_L", "D_error_T", "dp_plus_error"]].iloc[-1]
    assert ((errors > 0) & (errors < 0.05)).all()
    assert f"D_L = {with_error(*steady.table[['D_L', 'D_error_L']].iloc[-1], digits=3)}, D_T = " in steady.answer
    assert in_unit(None, VELOCITY, *steady.table[["dU", "dU_error"]].iloc[-1], "+") in steady.answer
    assert steady.record["settled"]["dU"] == pytest.approx(steady.table["dU"].iloc[-1:], rel=0.01)


YOUNG = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "mesh": {"Np": 8, "max_size": 0.3}, "time": {"end": 0.002}}


@pytest.mark.parametrize("stopped", [False, True])
def test_a_run_is_finished_without_its_quasi_steady_solution(stopped: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether there is none or a signal came meanwhile."""

    def settled(problem: Problem, _: object) -> None:
        if stopped:
            signal.raise_signal(signal.SIGTERM)
        problem.monitor.check()
        raise NoSteadyState("the shapes end")

    monkeypatch.setattr("pairsim.questions.run.written.settled", settled)
    result = pairsim.run(YOUNG, **FEW, signals=True)
    why = "the quasi-steady solution at the last distances was interrupted" if stopped else "the shapes end"
    assert result.status == "finished"
    assert f"Whether the start is forgotten is not known: {why}." in result.answer


@pytest.mark.slow
def test_without_a_quasi_steady_state_a_run_cannot_start_from_it() -> None:
    result = pairsim.run({**YOUNG, "Ca_e": 1, "start": "steady"}, **FEW)
    assert (result.status, result.reason) == ("failed", "not_resolved")
    assert "no quasi-steady state to start from" in result.message
    assert result.message.endswith("try start: rest")


SMALL = {"ends": "developed", "mesh": {"Np": 8, "max_size": 0.3}, "output": {"fields": False}}
PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.2, "length": 2.4, "time": {"end": 1e-3}, "limits": {"max_steps": 2}}
EXTREMES: dict[str, dict[str, Any]] = {
    "almost Newtonian": {"De": 1e-6, "xi": 0.5},
    "De 1e4": {"De": 1e4},
    "almost rigid": {"Ca_e": 1e-6},
    "Ca_e 1e4": {"Ca_e": 1e4},
    "small particles": {"beta": 0.001},
    "as wide as the tube": {"beta": 0.999, "length": 4.0},
    "narrow rows": {"De": 1, "mesh": {**SMALL["mesh"], "rows": 0.05}},
    "short time": {"time": {"end": 1e-9, "first_step": 1e-9}},
    "shortest tube": {"particles": 0, "beta": None, "Ca_e": None, "d0": None, "length": 0.1},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", EXTREMES)
def test_computes_or_ends_with_a_reason(name: str) -> None:
    case = {key: value for key, value in (SMALL | PAIR | EXTREMES[name]).items() if value is not None}
    result = pairsim.run(case)
    assert result.status == "finished" or result.reason in ("max_steps", "mesh_failed", "step_too_small"), (
        result.message
    )
    assert len(result.table) > 0
    assert np.isfinite(result.table["dp_plus"].to_numpy()).all()

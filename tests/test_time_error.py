"""A fixed step is kept or ends the run; time steps that leave more than the accuracy asked for are reported."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest
from conftest import dU, march, soft_pair

from pairsim.config.case_file import case_from_dict
from pairsim.drivers.run_output import RunWarnings
from pairsim.drivers.warnings import long_steps
from pairsim.fem.geometry import MeshSettings
from pairsim.runtime.errors import NewtonFailure
from pairsim.solvers.step_size import Scheme, StepControl
from pairsim.solvers.time_error import SAFETY, TimeError

KEYS: dict[str, Any] = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "ends": "developed", "length": "auto"}
COARSE = MeshSettings(Np=12)
ORDER = 3


def fixed(step: float) -> StepControl:
    return StepControl(3e-4, 1e-8, 2.0, fixed=step)


def estimate(t: np.ndarray, dU: np.ndarray, order: int = ORDER, mesh: np.ndarray | None = None) -> float:
    """The estimated error itself, where the largest |dU| is one."""
    error = TimeError(order)
    for row in zip(t.tolist(), np.zeros(len(t)) if mesh is None else mesh, dU, strict=True):
        error.add(row[0], int(row[1]), [row[2]])
    return error.part


def test_fixed_step_is_kept_from_the_first_one_on() -> None:
    steps = march(soft_pair(0.4, 0.1, 0.1, mesh=COARSE, control=fixed(0.1)), [0.5])
    assert [step.dt for step in steps] == pytest.approx([0.1] * 5)
    assert steps[0].report.iterations < 40
    fine = march(soft_pair(0.4, 0.1, 0.1, mesh=COARSE, control=fixed(0.01)), [0.5])
    assert dU(steps[-1]) == pytest.approx(dU(fine[-1]), rel=0.1)


def test_fixed_step_is_shortened_to_land_on_an_output_alone() -> None:
    steps = march(soft_pair(0.4, 0.1, 0.1, mesh=COARSE, control=fixed(0.02)), [0.05, 0.1])
    assert [step.dt for step in steps] == pytest.approx([0.02, 0.015, 0.015] * 2)


def test_fixed_step_that_cannot_be_solved_ends_the_run() -> None:
    problem = soft_pair(0.4, 0.1, 0.1, mesh=COARSE, control=fixed(20.0))
    with pytest.raises(NewtonFailure, match=r"fixed_step = 20 could not be kept at t = 0: .*leave it out"):
        march(problem, [40.0])


@pytest.mark.parametrize("order", [2, 3])
def test_estimate_is_what_bdf_leaves_of_a_polynomial(order: int) -> None:
    """Of the derivative of t^(order + 1), in steps that vary; the first three are too early to count."""
    t = np.array([0.001, 0.002, 0.003, 0.1, 0.2, 0.35, 0.5, 1.0])

    def left(k: int) -> float:
        old = t[k - order : k][::-1]
        scheme = Scheme.bdf(old.tolist(), t[k])
        h_star = sum(w * time ** (order + 1) for w, time in zip(scheme.weights, old, strict=True))
        return float(abs((t[k] ** (order + 1) - h_star) / scheme.g - (order + 1) * t[k] ** order))

    largest = max(left(k) for k in range(3, len(t)))
    assert estimate(t, t**order, order) == pytest.approx(SAFETY * largest / (order + 1), rel=1e-9)


def test_estimate_ignores_jumps_at_remeshings_and_the_first_moment() -> None:
    t = np.arange(1, 40) * 0.02
    smooth = np.cos(t)
    jumps = smooth + np.where(t > 0.4, 0.1, 0.0) + np.where(np.isclose(t, 0.42), 3.0, 0.0)
    assert estimate(t, jumps, mesh=(t > 0.41).astype(int)) == pytest.approx(estimate(t, smooth), rel=0.1)
    assert estimate(t, jumps) > 0.05
    assert estimate(t * 1e-4, smooth) == 0


def test_rounding_of_a_rigid_pair_is_no_error_of_steps() -> None:
    noise = 1e-11 * np.random.default_rng(0).uniform(-1, 1, 50)
    assert estimate(np.arange(1, 51) * 0.1, noise) < 1e-3


def test_accuracy_asked_for_is_the_limit() -> None:
    assert not long_steps(case_from_dict(KEYS, ""), 0.009)
    (warning,) = long_steps(case_from_dict(KEYS | {"time": {"fixed_step": 0.1}}, ""), 0.24)
    assert "about 24 % of the largest |dU|, more than accuracy: 1%; a smaller time.fixed_step" in warning
    assert not long_steps(case_from_dict(KEYS | {"accuracy": "5%"}, ""), 0.04)
    assert "time.tol" in long_steps(case_from_dict(KEYS | {"accuracy": "5%"}, ""), 0.06)[0]


Pairsim = Callable[..., CompletedProcess[str]]


def warnings(folder: Path) -> list[str]:
    """What run.json tells of time steps."""
    told: list[str] = json.loads((folder / "run.json").read_text())["warnings"]
    return [warning for warning in told if "time steps" in warning]


@pytest.mark.parametrize(
    ("setting", "warned"),
    [("tol: 3.0e-4", False), ("tol: 0.1", True), ("fixed_step: 0.1", True), ("fixed_step: 0.02", True)],
)
def test_long_steps_are_reported(setting: str, warned: bool, tmp_path: Path, pairsim: Pairsim) -> None:
    text = f"{{beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1, ends: developed, length: auto, mesh: {{Np: 12}}, time: {{{setting}"
    (tmp_path / "case.yaml").write_text(f"{text}, end: 1}}}}\n")
    done = pairsim("run", "case.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    assert bool(warnings(tmp_path / "out")) == warned
    assert ("time steps may leave" in done.stderr) == warned


def test_long_steps_before_a_stop_are_reported_after_it(tmp_path: Path, pairsim: Pairsim) -> None:
    text = "{beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1, ends: developed, length: auto, mesh: {Np: 12}"
    (tmp_path / "case.yaml").write_text(f"{text}, time: {{fixed_step: 0.1, end: 0.8}}}}\n")
    assert pairsim("run", "case.yaml", "-o", "whole", "-q").returncode == 0
    assert pairsim("run", "case.yaml", "-o", "parts", "-q", "--set", "time.end=0.2").returncode == 0
    assert pairsim("run", "case.yaml", "--resume", "parts", "-q").returncode == 0
    assert warnings(tmp_path / "parts") == warnings(tmp_path / "whole") != []


def test_record_of_a_finished_run_has_the_warning_too() -> None:
    """Written again from series.csv where a kill kept run.json from it."""
    case = case_from_dict(KEYS | {"time": {"fixed_step": 0.1}}, "")
    t = np.arange(1, 11) * 0.1
    series = {"t": t, "d": 0.1 + t, "dU": np.cos(10 * t), "mesh": 0 * t}
    assert any("time steps" in warning for warning in RunWarnings.of(case, series, (1.0, 0.0)).warnings)

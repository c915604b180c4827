"""Warnings of short tubes and large De in every computation, and refusals to resume another command's folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.commands import Pairsim

import pairsim
from pairsim.cases.checked_range import beyond_checked
from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import parse_case


@pytest.mark.slow
@pytest.mark.parametrize("ends", ["developed", "periodic"])
@pytest.mark.parametrize(
    ("compute", "place"),
    [
        (pairsim.run, {"d0": 0.5, "time": {"end": 0.002}, "output": {"fields": False}}),
        (pairsim.curve, {"d": [0.5]}),
        (pairsim.critical, {"d": [0.45, 0.5]}),
    ],
    ids=["run", "curve", "critical"],
)
def test_every_computation_tells_of_a_short_tube_and_of_a_De_above_all_that_were_checked(
    compute: Callable[..., pairsim.Result], place: dict[str, Any], ends: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pairsim.cases.checked_range.MOST_DE", 0.01)
    pair = {"beta": 0.4, "De": 0.02, "Ca_e": 0, "length": 2.4, "mesh": {"Np": 8, "max_size": 0.25}}
    warnings = compute(pair, ends=ends, **place).check().warnings
    assert sum("the ends affect dU" in warning for warning in warnings) == 1
    assert sum("De = 0.02 is above 0.01" in warning for warning in warnings) == 1


def test_largest_De_of_all_critical_distances_counts() -> None:
    asked = {"beta": 0.4, "De": 0.5, "Ca_e": 0.01, "d": [0.1, 0.5], "along": {"De": [0.5, 8]}}
    (warning,) = beyond_checked(parse_case(QUESTIONS["critical"], asked, "test"))
    assert "De = 8" in warning
    assert not beyond_checked(parse_case(QUESTIONS["critical"], {**asked, "along": {"De": [0.5, 2]}}, "test"))


def test_pair_that_outgrows_its_tube_ends_typed() -> None:
    pair = {"beta": [0.4, 0.3], "De": 0, "Ca_e": 0, "d0": 0.1, "ends": "developed", "length": 1.95, "mesh": {"Np": 8}}
    result = pairsim.run(pair, time={"end": 20}, output={"fields": False})
    assert (result.status, result.reason) == ("failed", "tube_too_short")
    assert any("the ends affect dU" in warning for warning in result.warnings)


def test_lone_rigid_sphere_takes_ever_larger_steps() -> None:
    sphere = {"particles": 1, "beta": 0.4, "De": 0, "Ca_e": 0, "ends": "developed", "length": 3, "mesh": {"Np": 8}}
    assert pairsim.run(sphere, time={"end": 2}).check().record["steps"] < 40


@pytest.mark.parametrize(
    ("record", "message"),
    [('{"kind": "curve"}', "results of another command"), ("", "must be a folder of results")],
    ids=["of another command", "of nobody"],
)
def test_resume_leaves_other_files_alone(record: str, message: str, tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text("beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "curve.csv").write_text("precious")
    (tmp_path / "out" / "run.json").write_text(record)
    done = pairsim("run", "case.yaml", "--resume", "out")
    assert done.returncode == 2
    assert message in done.stderr
    assert (tmp_path / "out" / "curve.csv").read_text() == "precious"


@pytest.mark.slow
def test_a_stress_that_cells_do_not_resolve_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    """At the wall of a pipe whose cells are half as large as its radius c changes by more than e^2 within a cell."""
    pipe = {"particles": 0, "De": 10, "ends": "developed", "length": 1, "mesh": {"max_size": 0.25}}
    for end, count in ((0.001, 0), (2, 1)):
        result = pairsim.run(pipe, time={"end": end}, output={"fields": False}, progress=True).check()
        assert len(result.warnings) == count
        assert ("is not resolved" in capfd.readouterr().err) == bool(count)


PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "ends": "developed", "length": 3, "mesh": {"Np": 8}}
PAIR |= {"output": {"fields": False}}


def about_steps(result: Any) -> list[str]:
    """Warnings of a result about time steps."""
    return [warning for warning in result.check().warnings if "time steps" in warning]


@pytest.mark.parametrize(("setting", "warned"), [({"tol": 3e-4}, False), ({"fixed_step": 0.02}, True)])
def test_long_steps_are_reported(setting: dict[str, float], warned: bool, capfd: pytest.CaptureFixture[str]) -> None:
    assert bool(about_steps(pairsim.run(PAIR, time={"end": 1, **setting}, progress=True))) == warned
    assert ("time steps may cause" in capfd.readouterr().err) == warned


@pytest.mark.slow
def test_long_steps_before_a_stop_are_reported_after_it(tmp_path: Path) -> None:
    long_steps = PAIR | {"time": {"fixed_step": 0.1, "end": 0.8}}
    whole = pairsim.run(long_steps)
    pairsim.run(long_steps, time={"end": 0.2}, folder=tmp_path).check()
    resumed = pairsim.run(long_steps, folder=tmp_path, resume=True)
    assert about_steps(resumed) == about_steps(whole) != []

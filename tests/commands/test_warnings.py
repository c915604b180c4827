"""Warnings of short tubes and large De in every computation, and refusals to resume another command's folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.commands import Pairsim

import pairsim
from pairsim.config.checked_range import beyond_checked
from pairsim.inputs.case_files import parse_case
from pairsim.questions import QUESTIONS


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
    monkeypatch.setattr("pairsim.config.checked_range.MOST_DE", 0.01)
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


@pytest.mark.parametrize("name", ["curve.csv", "study.csv"])
def test_resume_leaves_results_of_other_commands_alone(name: str, tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text("beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).write_text("precious")
    done = pairsim("run", "case.yaml", "--resume", "out")
    assert done.returncode == 2
    assert "results of another command" in done.stderr
    assert (tmp_path / "out" / name).read_text() == "precious"

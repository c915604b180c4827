"""Warnings of short tubes in every command, and refusals to resume another command's folder."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.commands import Pairsim


@pytest.mark.slow
@pytest.mark.parametrize("ends", ["developed", "periodic"])
@pytest.mark.parametrize(
    ("command", "place"),
    [
        ("run", "d0: 0.5\ntime: {end: 0.002}\noutput: {fields: false}\n"),
        ("curve", "d: [0.5]\n"),
        ("critical", "d: [0.45, 0.5]\n"),
    ],
)
def test_every_command_tells_of_a_short_tube(
    command: str, place: str, ends: str, tmp_path: Path, pairsim: Pairsim
) -> None:
    """With 2.4 D_c dU is 16 % (developed ends) and 44 % (periodic ends) off at De 2."""
    keys = f"beta: 0.4\nDe: 2\nCa_e: 0\nends: {ends}\nmesh: {{Np: 8, max_size: 0.25, rows: 0.5}}\n"
    keys += "" if command == "run" else "mesh_error: false\n"
    (tmp_path / "case.yaml").write_text(keys + place)
    done = pairsim(command, "case.yaml", "-o", "out", "-q", "--set", "length=2.4")
    assert done.returncode == 0, done.stderr
    warnings = json.loads((tmp_path / "out" / "run.json").read_text())["warnings"]
    assert sum("the ends affect dU" in warning for warning in warnings) == 1


def test_pair_that_outgrows_its_tube_ends_typed(tmp_path: Path, pairsim: Pairsim) -> None:
    keys = "beta: [0.4, 0.3]\nDe: 0\nCa_e: 0\nd0: 0.1\nends: developed\nlength: 1.95\nmesh: {Np: 8}\n"
    (tmp_path / "case.yaml").write_text(keys + "time: {end: 20}\noutput: {fields: false}\n")
    done = pairsim("run", "case.yaml", "-o", "out", "-q")
    assert done.returncode == 3, done.stderr
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert record["reason"] == "tube_too_short"
    assert any("the ends affect dU" in warning for warning in record["warnings"])


def test_lone_rigid_sphere_takes_ever_larger_steps(tmp_path: Path, pairsim: Pairsim) -> None:
    keys = "particles: 1\nbeta: 0.4\nDe: 0\nCa_e: 0\nends: developed\nlength: 3\nmesh: {Np: 8}\ntime: {end: 2}\n"
    (tmp_path / "case.yaml").write_text(keys)
    assert pairsim("run", "case.yaml", "-o", "out", "-q").returncode == 0
    assert json.loads((tmp_path / "out" / "run.json").read_text())["steps"] < 40


@pytest.mark.parametrize("name", ["curve.csv", "study.csv"])
def test_resume_leaves_results_of_other_commands_alone(name: str, tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text("beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).write_text("precious")
    done = pairsim("run", "case.yaml", "--resume", "out")
    assert done.returncode == 2
    assert "results of another command" in done.stderr
    assert (tmp_path / "out" / name).read_text() == "precious"

"""Time steps with an estimated error above the requested accuracy give a warning."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.commands import Pairsim


def warnings(folder: Path) -> list[str]:
    """Warnings about time steps in run.json."""
    warnings: list[str] = json.loads((folder / "run.json").read_text())["warnings"]
    return [warning for warning in warnings if "time steps" in warning]


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
    assert ("time steps may cause" in done.stderr) == warned


@pytest.mark.slow
def test_long_steps_before_a_stop_are_reported_after_it(tmp_path: Path, pairsim: Pairsim) -> None:
    text = "{beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1, ends: developed, length: auto, mesh: {Np: 12}"
    (tmp_path / "case.yaml").write_text(f"{text}, time: {{fixed_step: 0.1, end: 0.8}}}}\n")
    assert pairsim("run", "case.yaml", "-o", "whole", "-q").returncode == 0
    assert pairsim("run", "case.yaml", "-o", "parts", "-q", "--set", "time.end=0.2").returncode == 0
    assert pairsim("run", "case.yaml", "--resume", "parts", "-q").returncode == 0
    assert warnings(tmp_path / "parts") == warnings(tmp_path / "whole") != []

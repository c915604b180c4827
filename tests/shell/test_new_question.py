"""A question is one file: that of docs/how-to/add-question.md, in a folder beside those of the package."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.inputs import ROOT

PAGE = ROOT / "docs" / "how-to" / "add-question.md"
BEGIN = "import sys, pairsim.questions\npairsim.questions.__path__.append(sys.argv.pop(1))\n"
"""What lists the questions of a folder, too."""
CASE = "{particles: 1, beta: 0.4, De: 0, Ca_e: 0.1, length: 4, mesh: {Np: 10}}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the file of the page, and a case file for it."""
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert code is not None
    (tmp_path / "questions").mkdir()
    (tmp_path / "questions" / "speed.py").write_text(code[1])
    (tmp_path / "case.yaml").write_text(CASE)
    return tmp_path


def python(folder: Path, code: str, *words: str) -> str:
    """What Python prints, which knows the question."""
    command = [sys.executable, "-c", BEGIN + code, str(folder / "questions"), *words]
    environment = os.environ | {"COLUMNS": "100"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def pairsim(folder: Path, *words: str) -> str:
    return python(folder, "from pairsim.app.command_line import main; main()", *words)


def test_it_has_a_command_with_help_and_a_schema(folder: Path) -> None:
    assert "speed      Compute the velocity of one particle." in pairsim(folder, "--help")
    assert "Example: pairsim speed case.yaml" in pairsim(folder, "speed", "--help")
    assert "1: the particle is on its own" in pairsim(folder, "schema", "speed")
    assert "unknowns" in pairsim(folder, "speed", "case.yaml", "--dry-run")


@pytest.mark.slow
def test_it_is_computed_and_read_again(folder: Path) -> None:
    assert pairsim(folder, "speed", "case.yaml", "-o", "out") == "out\n"
    assert pairsim(folder, "table", "out").startswith("U_1 [U_av],")
    assert "finished" in pairsim(folder, "status", "out")
    code = "import pickle; import pairsim as p; found = pickle.loads(pickle.dumps(p.speed('case.yaml')))\n"
    said = python(folder, code + "print(type(found) is p.SpeedResult, p.open('out').findings() == found.findings())")
    assert said == "True True\n"

"""`scripts/validation` on coarse cells: differences within bounds, and nothing but its folder is written."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.inputs import ROOT


@pytest.mark.long
def test_every_page_can_be_computed(tmp_path: Path) -> None:
    folders = (ROOT / "docs" / "validation", ROOT / "docs" / "results" / "validation")
    before = {path: path.read_bytes() for folder in folders for path in folder.rglob("*") if path.is_file()}
    command = [sys.executable, str(ROOT / "scripts" / "validation.py"), "all", "--quick", "-o", str(tmp_path)]
    done = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("Larger than allowed: nothing.") == len(list(folders[0].glob("*.md"))) - 1
    assert all(path.read_bytes() == content for path, content in before.items())

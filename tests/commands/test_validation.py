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
    book = {path: path.read_bytes() for path in (ROOT / "docs" / "validation").rglob("*") if path.is_file()}
    command = [sys.executable, str(ROOT / "scripts" / "validation.py"), "all", "--quick", "-o", str(tmp_path)]
    done = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert {path.stem for path in tmp_path.glob("*.json")} == {path.stem for path in book if path.suffix == ".json"}
    assert all(path.read_bytes() == content for path, content in book.items())

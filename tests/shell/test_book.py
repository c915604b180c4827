"""What studies are judged by, and the pictures of the documents, each of which has a command."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from support.inputs import ROOT

sys.path.append(str(ROOT / "scripts"))  # the modules of a script lie beside it

import pictures
from book.statements import Judged


def test_every_picture_of_the_documents_has_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "state", lambda paths: " ".join(paths))
    commands = {name: command for name, command, _ in pictures.pictures()}
    drawn = {str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.png")}
    assert drawn <= commands.keys()
    assert commands["docs/images/paper/fig02.png"].startswith("scripts/study paper --only fig02; ")


@pytest.mark.parametrize(("command", "fault"), [("true", "made.png not made"), ("false", "exit code 1")])
def test_a_picture_that_is_not_made_is_told(
    command: str, fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pictures, "ROOT", tmp_path)
    (tmp_path / "made.png").touch()
    os.utime(tmp_path / "made.png", (0, 0))
    with pytest.raises(SystemExit, match=fault):
        pictures.make(command, ["made.png"])
    pictures.make("touch made.png", ["made.png"])


@pytest.mark.parametrize(
    ("margins", "verdict"),
    [
        ([(1.0, 0.1), (0.2, 0.1)], "holds"),
        ([(1.0, 0.1), (0.05, 0.1)], "within error"),
        ([(-0.05, 0.1), (1.0, 0.1)], "within error"),
        ([(0.05, 0.1), (-0.2, 0.1)], "does not hold"),
    ],
)
def test_verdicts(margins: list[tuple[float, float]], verdict: str) -> None:
    assert Judged(tuple(margins)).verdict == verdict

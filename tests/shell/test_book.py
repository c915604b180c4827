"""What studies are judged by, and the pictures of the documents, each of which has a command."""

from __future__ import annotations

import sys

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
    assert commands["docs/images/paper/fig02.png"] == "scripts/study paper --only fig02 && scripts/study paper --page"


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

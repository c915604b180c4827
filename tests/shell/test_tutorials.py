"""README, tutorials, and pages about films and Python, executed: files are written, commands run in a new folder.

A block of `text` is what the commands before it print: each of its lines must follow, in this order, numbers to 2 %;
`...` stands for anything. Commands of pairsim are run in this process, but for those that bring laws, which would stay.
"""

from __future__ import annotations

import contextlib
import io
import math
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from support.commands import Done, in_process
from support.inputs import ROOT

TUTORIALS = [ROOT / "README.md", *sorted((ROOT / "docs" / "tutorials").glob("*.md"))]
TUTORIALS += [ROOT / "docs" / "how-to" / name for name in ("films.md", "python.md")]
BLOCK = re.compile(
    r"(?:<!-- (?P<note>[^>]*) -->\n\n)?^```(?P<language>\w+)(?: title=\"(?P<title>[^\"]+)\")?\n(?P<text>.*?)^```$",
    re.DOTALL | re.MULTILINE,
)
NOTES = {None: 0, "ends with exit code 2": 2}
LONG = {"own-law"}
"""Pages that take most of a minute; the law of this one is also computed and checked in test_own_laws.py."""


class Block(NamedTuple):
    """A fenced block: its language, the file that it is, what the comment before it says, its text."""

    language: str
    title: str | None
    note: str | None
    text: str


def blocks(page: Path) -> Iterator[Block]:
    """All fenced blocks of a page."""
    for match in BLOCK.finditer(page.read_text()):
        yield Block(match["language"], match["title"], match["note"], match["text"])


def shell(line: str, folder: Path, given: str = "") -> Done:
    """Run a line of shell on some input."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    environment = os.environ | {"PATH": path, "PYTHONPATH": str(ROOT)}
    words = ["bash", "-euo", "pipefail", "-c", line]
    return subprocess.run(
        words, cwd=folder, env=environment, input=given, capture_output=True, text=True, timeout=600, check=False
    )


def commands(text: str, folder: Path, capture: pytest.CaptureFixture[str]) -> tuple[str, int]:
    """Output of the lines of a block, and the exit code of the last one; the others succeed."""
    output, code = "", 0
    for line in text.splitlines():
        assert code == 0, output
        if line.startswith("pairsim ") and "my_laws" not in line:
            words, _, rest = line.partition(" | ")
            done = in_process(folder, tuple(shlex.split(words)[1:]), capture)
            if rest and done.returncode == 0:
                done = shell(rest, folder, done.stdout)
        else:
            done = shell(line, folder)
        output, code = output + done.stderr + done.stdout, done.returncode
    return output, code


def python(text: str, names: dict[str, Any]) -> str:
    """What a block prints; `names` are shared by the blocks of a page."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(text, "tutorial", "exec"), names)
    return printed.getvalue()


def alike(expected: str, found: str) -> bool:
    """Whether a line is the expected one."""
    wanted, given = (re.findall(r"[^\s,]+", line) for line in (expected, found))
    for i, word in enumerate(wanted):
        if word == "...":
            return i == len(wanted) - 1 or alike(" ".join(wanted[i + 1 :]), " ".join(given[i + 1 :]))
        if i >= len(given) or not (word == given[i] or close(word, given[i])):
            return False
    return len(wanted) == len(given)


def close(expected: str, found: str) -> bool:
    try:
        return math.isclose(float(expected), float(found), rel_tol=0.02)
    except ValueError:
        return False


def shows(expected: str, output: str) -> bool:
    """Whether the expected lines follow one another in the output."""
    lines = iter(output.splitlines())
    return all(any(alike(line, found) for found in lines) for line in expected.splitlines())


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.long if page.stem in LONG else pytest.mark.slow, id=page.stem)
        for page in TUTORIALS
    ],
)
def test_tutorial(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for file in page.with_suffix("").glob("*"):  # which the page offers
        shutil.copy(file, tmp_path)
    names: dict[str, Any] = {"__name__": "tutorial"}
    output, executed = "", 0
    for block in blocks(page):
        if block.note == "is not executed":
            continue
        if block.title is not None:
            (tmp_path / block.title).write_text(block.text)
        elif block.language == "sh":
            output, code = commands(block.text, tmp_path, capfd)
            assert code == NOTES[block.note], output
            executed += 1
        elif block.language == "python":
            output, executed = python(block.text, names), executed + 1
        elif block.language == "text":
            assert shows(block.text, output), f"expected\n{block.text}\nfound\n{output}"
        else:
            assert block.language == "yaml", block
    assert executed >= 2

"""Whatever is typed, a command ends with a result, or with a message and exit code 2: hypothesis makes the inputs.

The seed is fixed; as hypothesis also takes constants from the modules that are loaded, inputs differ with the code and
with the tests that ran before in the same process.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from support.commands import Done, apart, in_process
from support.fuzz import CASES, KINDS, Input

from pairsim.runtime.text import control_characters

LONGEST_MESSAGE = 30_000  # characters: 20 mistakes, each with what is allowed
FIXED = settings(
    derandomize=True, database=None, deadline=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
)


def folder_for(given: Input, folder: Path) -> Path:
    """Write the files of an input into a new folder."""
    folder.mkdir()
    for name, text in given.files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        if text is None:
            os.mkfifo(folder / name)
        else:
            (folder / name).write_bytes(text.encode("utf-8", "surrogateescape"))
    return folder


def check(given: Input, done: Done, folder: Path) -> None:
    """A command ended with a result, or with a message on what is wrong, and wrote nothing."""
    said = f"{given}\n{done}"
    assert done.returncode in (0, 2), said
    assert "Traceback" not in done.stderr, said
    assert len(done.stderr) <= LONGEST_MESSAGE, said
    assert not any(map(control_characters, done.stderr.splitlines())), said
    assert {str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir()} == given.files.keys(), (
        said
    )
    if done.returncode == 0:
        assert done.stdout, said
    else:
        assert re.match(r"pairsim( \w+)?: |Usage: ", done.stderr), said
        assert done.stdout == "", said


def fuzz(kind: str, count: int, root: Path, capture: pytest.CaptureFixture[str]) -> Counter[int]:
    """Type inputs of a kind in this process; returns how often each exit code came."""
    codes: Counter[int] = Counter()

    @settings(FIXED, max_examples=count)
    @given(KINDS[kind])
    def each(given: Input) -> None:
        folder = folder_for(given, root / str(codes.total()))
        done = in_process(folder, given.arguments, capture)
        check(given, done, folder)
        codes[done.returncode] += 1

    each()
    return codes


@pytest.fixture(autouse=True)
def _no_study(monkeypatch: pytest.MonkeyPatch) -> None:
    """`study`, which has no --dry-run, ends where it would begin to compute."""
    monkeypatch.setattr("pairsim.sweeps.study.run_study", lambda *_, **__: (0, "read"))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_no_input_ends_with_a_traceback(kind: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    codes = fuzz(kind, 100, tmp_path, capfd)
    assert codes[2] > codes.total() / 10
    assert codes[0] > 0


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_nor_do_twenty_times_as_many(kind: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    codes = fuzz(kind, 2000, tmp_path, capfd)
    print(f"{kind}: exit codes {dict(codes)}")
    assert codes.total() > 1000


@pytest.mark.slow
@pytest.mark.parametrize("command", [name for name in CASES if name != "study"])
def test_a_damaged_file_ends_a_real_command_in_order(command: str, tmp_path: Path) -> None:
    @settings(FIXED, max_examples=2)
    @given(KINDS[command])
    def each(given: Input) -> None:
        folder = folder_for(given, tmp_path / str(len(list(tmp_path.iterdir()))))
        check(given, apart(folder, *given.arguments), folder)

    each()

"""Names of files that are not in UTF-8, as the system hands them out: bytes of another encoding."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest
from support.commands import Pairsim
from support.inputs import SMALL

from pairsim.record.folder import plain
from pairsim.runtime.child_process import module_command
from pairsim.runtime.text import printable

OUT = os.fsdecode(b"out\xe9")
STRICT = {**os.environ, "PYTHONIOENCODING": "utf-8:strict"}
"""As in a locale that names UTF-8, such as de_DE.UTF-8."""


def apart(folder: Path, *words: str) -> subprocess.CompletedProcess[bytes]:
    command = module_command("pairsim", *words)
    return subprocess.run(command, cwd=folder, capture_output=True, env=STRICT, check=False)


def test_text_for_files_is_in_utf_8() -> None:
    assert printable(f"run {OUT}: µ") == r"run out\xe9: µ"
    assert plain({"command": OUT, "folder": [Path(OUT)]}) == {"command": r"out\xe9", "folder": [r"out\xe9"]}


@pytest.mark.slow
def test_a_run_and_what_reads_it_take_any_name(tmp_path: Path) -> None:
    case = os.fsdecode(b"c\xe9.yaml")
    (tmp_path / case).write_text(f"{{d0: 0.1, {SMALL}, time: {{end: 0.01}}}}\n")
    done = apart(tmp_path, "run", case, "-o", OUT)
    assert done.returncode == 0, done.stderr
    assert done.stdout == os.fsencode(OUT) + b"\n"
    record = json.loads((tmp_path / OUT / "run.json").read_text())
    assert record["command"] == r"pairsim run 'c\xe9.yaml' -o 'out\xe9'"
    for words in (["status", OUT], ["table", OUT], ["plot", OUT], ["report", OUT], ["run", "--resume", OUT]):
        done = apart(tmp_path, *words)
        assert done.returncode == 0, done.stderr
    assert r"out\xe9" in (tmp_path / OUT / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_sweep_takes_any_name_and_folders_are_named_in_pictures(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "grid.yaml").write_text(f"base: {{{SMALL}, time: {{end: 0.01}}}}\ngrid: {{d0: [0.1, 0.2]}}\n")
    assert pairsim("sweep", "grid.yaml", "-o", OUT).returncode == 0
    assert pairsim("report", OUT).returncode == 0
    (tmp_path / OUT / "a").mkdir()
    first, second = (file.parent for file in (tmp_path / OUT).glob("*/series.csv"))
    first.rename(tmp_path / os.fsdecode(b"a\xe9"))
    second.rename(tmp_path / "b")
    done = pairsim("plot", os.fsdecode(b"a\xe9"), "b", "-o", "pictures")
    assert done.returncode == 0, done.stderr


def test_a_case_is_named_after_its_file_if_it_can_be(tmp_path: Path, pairsim: Pairsim) -> None:
    experiment = ("--tube", "50um", "--particle", "20um", "--flow", "1ul/min", "--viscosity", "1Pa.s")
    for file in (f"{OUT}.yaml", "my case.yaml", "case.yaml"):
        assert pairsim("units", *experiment, "-o", file).returncode == 0
        done = pairsim("run", file, "--dry-run")
        assert done.returncode == 0, done.stderr
        assert ("name: case" in (tmp_path / file).read_text()) == (file == "case.yaml")

"""What is missing, full, closed, torn or removed: a sentence, an exit code, nothing left behind, and on later."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from pathlib import Path

import pytest
from support.commands import Pairsim
from support.inputs import TINY

from pairsim.fem.compilation import jit
from pairsim.record.folder import write_bytes
from pairsim.record.record import Record
from pairsim.sweeps.folder import read_sweep

TUBE = "particles: 0\nDe: 0\nlength: 2\nends: developed\ntime: {end: 0.01}\n"
PAIR = "beta: 0.4\nDe: 0\nCa_e: 0\nd0: 0.1\nlength: 3\nmesh: {Np: 6}\ntime: {end: 0.01}\n"
FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def refuse(*_: object, **__: object) -> None:
    raise FULL


@pytest.mark.slow
def test_picture_that_cannot_be_written_is_a_warning(
    tmp_path: Path, pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "case.yaml").write_text(
        PAIR.replace("d0: 0.1", "d: [0.1, 0.11]").replace("time: {end: 0.01}\n", "max_points: 2\n")
    )

    def write(path: Path, content: bytes) -> None:
        if path.suffix == ".png":
            raise FULL
        write_bytes(path, content)

    monkeypatch.setattr("pairsim.record.folder.write_bytes", write)
    done = pairsim("curve", "case.yaml", "-o", "out")
    assert done.returncode == 0
    assert done.stdout.strip() == "out"
    assert "warning: no picture: out/curve.png" in done.stderr
    assert "pairsim plot out draws it" in done.stderr
    assert Record.read(tmp_path / "out").status == "finished"


def test_a_folder_that_was_removed_ends_the_command_with_a_file_that_cannot_be_written(
    tmp_path: Path, pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch
) -> None:
    def remove(path: Path, *_: object) -> None:
        shutil.rmtree(path.parent)
        raise FileNotFoundError(errno.ENOENT, "No such file or directory")

    monkeypatch.setattr("pairsim.record.table_files.write_text", remove)
    (tmp_path / "curve.yaml").write_text("beta: 0.4\nDe: 0\nCa_e: 0\nlength: 3\nmesh: {Np: 6}\nd: [0.1]\n")
    done = pairsim("curve", "curve.yaml", "-o", "out", "--set", "tol=1")
    assert done.returncode == 3
    assert "write_failed: out/run.json cannot be written (No such file or directory)" in done.stderr
    assert not any(said in done.stderr for said in ("No point", "Traceback"))


@pytest.fixture
def without_forms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Base folder, not there, of a cache of compiled forms; this process forgets those that it has loaded."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setitem(jit.JIT_OPTIONS, "cache_dir", jit._default())
    monkeypatch.setattr("pairsim.fem.phases.compiled_phase._COMPILED", {})
    return tmp_path / "cache"


@pytest.mark.slow
def test_no_compiler_is_a_sentence_and_not_the_fault_of_a_case(
    without_forms: Path, tmp_path: Path, pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    (tmp_path / "case.yaml").write_text(TUBE)
    done = pairsim("run", "case.yaml", "-o", "out", "-q")
    assert done.returncode == 4
    assert "there is no C compiler (no-such-compiler)" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert Record.read(tmp_path / "out").reason == "environment"
    (tmp_path / "grid.yaml").write_text(TINY + "grid: {d0: [0.1, 0.2]}\n")
    done = pairsim("sweep", "grid.yaml", "-o", "swept", "-q")
    assert done.returncode == 4
    assert "there is no C compiler" in done.stderr
    counts = read_sweep(tmp_path / "swept").counts
    assert (counts["failed"], counts["pending"]) == (1, 1), "no further case begins"


def test_cache_that_cannot_be_written_is_named_with_what_to_do(
    without_forms: Path, tmp_path: Path, pairsim: Pairsim
) -> None:
    without_forms.touch()
    (tmp_path / "case.yaml").write_text(TUBE)
    done = pairsim("run", "case.yaml", "-o", "out", "-q")
    assert done.returncode == 4
    assert f"the cache of compiled forms, {without_forms}" in done.stderr
    assert "cannot be written (Not a directory); try another folder in the environment variable XDG_CACHE_HOME" in (
        done.stderr
    )


def test_no_home_folder_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", none)
    assert Path(jit._default()).is_relative_to(tempfile.gettempdir())


@pytest.mark.slow
def test_doctor_says_what_was_found(pairsim: Pairsim) -> None:
    done = pairsim("doctor")
    assert done.returncode == 0, done.stderr
    for name in (
        "C compiler: /",
        "cache of compiled forms: /",
        "mpirun: ",
        "MPI: ",
        "FEniCSx: ",
        "a small case: dp = 32",
    ):
        assert f"\n{name}" in done.stdout, name


def test_doctor_says_what_is_missing(pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    done = pairsim("doctor")
    assert done.returncode == 4
    assert "there is no C compiler (no-such-compiler); try apt install gcc" in done.stderr

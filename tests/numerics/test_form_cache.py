"""The cache of compiled forms: entries are there whole or not at all, and a killed compilation blocks none."""

from __future__ import annotations

import errno
import os
import subprocess
import threading
import time
from pathlib import Path

import pytest

from pairsim.fem.compilation.jit import JIT_OPTIONS, UNFINISHED, in_cache
from pairsim.record.record import Record
from pairsim.runtime.child_process import module_command
from pairsim.runtime.errors import EnvironmentFailure

TUBE = "{particles: 0, De: 0, ends: developed, length: 2, time: {end: 0.01}, output: {fields: false}}\n"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache."""
    monkeypatch.setitem(JIT_OPTIONS, "cache_dir", str(tmp_path / "cache"))
    return tmp_path / "cache"


def build(folder: Path) -> None:
    (folder / "module.so").write_text("whole")


def test_a_full_disk_leaves_no_part_of_a_module(cache: Path) -> None:
    def torn(folder: Path) -> None:
        (folder / "module.so").write_text("wh")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(EnvironmentFailure, match=r"cannot be written \(No space left"):
        in_cache("form", torn)
    assert not (cache / "form").exists()
    assert (in_cache("form", build) / "module.so").read_text() == "whole"


def test_of_two_that_need_the_same_the_second_waits_for_the_first(cache: Path) -> None:
    built, begun = [], threading.Event()

    def slow(folder: Path) -> None:
        begun.set()
        time.sleep(0.3)
        built.append("first")
        build(folder)

    first = threading.Thread(target=in_cache, args=("form", slow))
    first.start()
    begun.wait()
    assert (in_cache("form", lambda _: built.append("second")) / "module.so").read_text() == "whole"
    first.join()
    assert built == ["first"]
    assert not (cache / UNFINISHED).exists()


def test_what_is_there_is_not_built_and_needs_no_compiler(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_cache("form", build)
    monkeypatch.setenv("CC", "no-such-compiler")
    assert in_cache("form", lambda _: pytest.fail("is there")) == cache / "form"
    with pytest.raises(EnvironmentFailure, match=r"no C compiler \(no-such-compiler\)"):
        in_cache("another", build)


@pytest.mark.slow
def test_a_run_compiles_what_it_needs_after_one_that_was_killed_in_the_compiler(tmp_path: Path) -> None:
    """What a killed process has begun is not in the cache, and what is there after another one is all of it."""
    (tmp_path / "case.yaml").write_text(TUBE)
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "empty")}
    run = module_command("pairsim", "run", "case.yaml", "-o", "out", "--overwrite")

    killed = subprocess.Popen(run, cwd=tmp_path, env=environment, stderr=subprocess.DEVNULL)
    while not list((tmp_path / "empty").rglob("libffcx*.c")):
        assert killed.poll() is None
        time.sleep(0.01)
    killed.kill()
    killed.wait()
    done = subprocess.run(run, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True, timeout=600)
    assert done.stderr.count("note: compiling") == 1
    assert not list((tmp_path / "empty").rglob(UNFINISHED))
    modules = list((tmp_path / "empty").glob("pairsim/*/form-*"))
    assert len(modules) == 2
    assert all(list(path.glob("*.so")) and list(path.glob("*.c.cached")) for path in modules)
    done = subprocess.run(run, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True)
    assert "compiling" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "code", "status", "said"),
    [("kill -INT $PPID; exit 1", 130, "interrupted", ""), ("exit 1", 4, "failed", "the forms cannot be compiled")],
    ids=["Ctrl-C, which the terminal sends to the compiler too", "a fault of the compiler"],
)
def test_a_compiler_that_fails_is_not_the_fault_of_a_case(
    script: str, code: int, status: str, said: str, tmp_path: Path
) -> None:
    (tmp_path / "cc.sh").write_text(f"#!/bin/sh\n{script}\n")
    (tmp_path / "cc.sh").chmod(0o755)
    (tmp_path / "case.yaml").write_text(TUBE)
    run = module_command("pairsim", "run", "case.yaml", "-o", "out", "-q")
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "empty"), "CC": str(tmp_path / "cc.sh")}
    done = subprocess.run(run, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert Record.read(tmp_path / "out").status == status

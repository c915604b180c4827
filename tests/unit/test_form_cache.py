"""The cache of compiled forms: entries are there whole or not at all."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.inputs import TINY

from pairsim.fem import form_cache
from pairsim.fem.compilation.jit import JIT_OPTIONS, UNFINISHED, in_cache
from pairsim.runtime.child_process import module_command


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

    with pytest.raises(OSError, match="No space left"):
        in_cache("form", torn)
    assert not list(cache.iterdir())
    assert (in_cache("form", build) / "module.so").read_text() == "whole"


def test_a_disk_that_is_full_only_when_files_are_written_to_it(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As with NFS and quotas: the linker has ended without an error."""

    def fsync(file: int) -> None:
        raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))

    monkeypatch.setattr(os, "fsync", fsync)
    with pytest.raises(OSError, match="quota"):
        in_cache("form", build)
    assert not list(cache.iterdir())


def test_of_two_processes_that_build_the_same_the_first_one_counts(cache: Path) -> None:
    def second(folder: Path) -> None:
        in_cache("form", build)
        (folder / "module.so").write_text("the same, later")

    assert (in_cache("form", second) / "module.so").read_text() == "whole"
    assert [path.name for path in cache.iterdir()] == ["form"]


def test_what_is_there_is_not_built(cache: Path) -> None:
    in_cache("form", build)
    assert in_cache("form", lambda _: pytest.fail("is there")) == cache / "form"


def test_what_a_killed_compilation_left_is_deleted_when_it_is_old(cache: Path) -> None:
    for name in ("old", "new"):
        (cache / f"{UNFINISHED}{name}").mkdir(parents=True)
    os.utime(cache / f"{UNFINISHED}old", (0, 0))
    form_cache.compile_missing([])
    assert sorted(path.name for path in cache.iterdir()) == ["compile.lock", f"{UNFINISHED}new"]


@pytest.mark.slow
def test_warming_up_compiles_all_that_a_case_needs_after_a_killed_compilation(tmp_path: Path) -> None:
    """What a killed process has begun is not in the cache, and what is there after another one is all of it."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    kinds = ["newtonian:moving", "neo-hookean", "newtonian:moving:enriched", "neo-hookean:enriched"]
    forms = module_command("pairsim.fem.form_cache", *kinds)

    def modules() -> set[Path]:
        return {path for path in (tmp_path / "cache").rglob("form-*") if not path.parent.name.startswith(UNFINISHED)}

    warming = subprocess.Popen(forms, env=environment)
    while warming.poll() is None and not list((tmp_path / "cache").rglob("libffcx*.c")):
        time.sleep(0.01)
    warming.kill()
    warming.wait()
    assert list((tmp_path / "cache").rglob("libffcx*.c"))
    assert not modules()
    subprocess.run(forms, env=environment, check=True, timeout=600)
    compiled = modules()
    assert len(compiled) == 6
    assert all(list(path.glob("*.so")) and list(path.glob("*.c.cached")) for path in compiled)
    (tmp_path / "case.yaml").write_text(TINY.partition(": ")[2].replace("Ca_e: 0", "Ca_e: 0.1, d0: 0.1"))
    run = module_command("pairsim", "run", "case.yaml", "-q")
    subprocess.run(run, cwd=tmp_path, env=environment, check=True, capture_output=True)
    assert modules() == compiled
    known = (
        "import sys; from pairsim.fem.form_cache import compile_missing; compile_missing(sys.argv[1:]); "
        "assert 'dolfinx' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", known, *kinds], env=environment, check=True)  # by its stamps

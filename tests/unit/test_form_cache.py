"""The cache of compiled forms: entries are there whole or not at all."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from pairsim.fem import form_cache
from pairsim.fem.compilation.jit import JIT_OPTIONS, UNFINISHED, in_cache


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

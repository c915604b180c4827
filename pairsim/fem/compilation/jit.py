"""Cache and options of the just-in-time compilation of forms.

Forms are compiled for the instruction set of the processor (`-march=native`). The path of the cache contains a hash of
the processor's features, so that different machines with a common home folder do not share compiled code.
"""

from __future__ import annotations

import hashlib
import logging
import os
import platform
import shlex
import shutil
import sysconfig
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from pairsim.runtime.errors import EnvironmentFailure


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace")
        flags = next((line for line in text.splitlines() if line.startswith(("flags", "Features"))), "")
    except OSError:
        flags = platform.processor()
    return hashlib.sha256((platform.machine() + flags).encode()).hexdigest()[:12]


def _default() -> str:
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # no home folder
        base = Path(tempfile.gettempdir())
    return str(base / "pairsim" / _processor())


JIT_OPTIONS: dict[str, Any] = {
    "cache_dir": _default(),
    "cffi_extra_compile_args": ["-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math"],
    "cffi_libraries": ["m"],
}
UNFINISHED = "unfinished-"
"""Prefix of the folders of the cache in which entries are built; a process that is killed leaves its own."""
LOG = logging.getLogger(__name__)
"""Says, at the level INFO, that an entry is missing."""
LOG.setLevel(logging.INFO)


def cache() -> Path:
    """Folder of the compiled forms."""
    return Path(JIT_OPTIONS["cache_dir"])


def in_cache(name: str, build: Callable[[Path], None]) -> Path:
    """An entry of the cache, built unless it is there: whole, or not at all.

    It is built in another folder, written to the disk and renamed. Other processes therefore never see a part of it,
    and neither a process that is killed nor a full disk leaves one. Those that need it at the same time wait for the
    first one.

    Args:
        name: Its name, which determines its content.
        build: Writes its files into a new folder.

    Returns:
        Its folder.

    Raises:
        EnvironmentFailure: There is no C compiler, or the cache cannot be written to; also what `build` raises.
    """
    entry = cache() / name
    if entry.is_dir():
        return entry
    if shutil.which(compiler()) is None:
        advice = "apt install gcc libc6-dev, or the environment variable CC (docs/how-to/install.md)"
        raise EnvironmentFailure(f"there is no C compiler ({compiler()}), which compiles the forms", advice=advice)
    LOG.info("compiling what this kind of scene needs, once: some ten seconds")
    try:
        cache().mkdir(parents=True, exist_ok=True)
        with _sole_builder(entry):
            if not entry.is_dir():
                _build_beside(entry, build)
    except OSError as error:
        message = f"the cache of compiled forms, {cache()}, cannot be written ({error.strerror or error})"
        advice = "another folder in the environment variable XDG_CACHE_HOME"
        raise EnvironmentFailure(message, advice=advice) from error
    return entry


@contextmanager
def _sole_builder(entry: Path) -> Iterator[None]:
    """Context of the only process that builds an entry; removes what killed ones have left of it."""
    from filelock import FileLock

    lock = FileLock(entry.with_name(f"{entry.name}.lock"))
    with suppress(OSError):  # without locks several processes build the same, and the first one's stays
        lock.acquire()
        for left in cache().glob(f"{UNFINISHED}{entry.name}-*"):
            shutil.rmtree(left, ignore_errors=True)
    try:
        yield
    finally:
        if lock.is_locked:
            # Before the release, so that none of the next owner is removed.
            Path(lock.lock_file).unlink(missing_ok=True)
            lock.release()


def _build_beside(entry: Path, build: Callable[[Path], None]) -> None:
    prefix = f"{UNFINISHED}{entry.name}-"
    with tempfile.TemporaryDirectory(prefix=prefix, dir=cache(), ignore_cleanup_errors=True) as place:
        built = Path(place) / entry.name
        built.mkdir()
        build(built)
        for path in built.iterdir():
            with path.open("rb") as file:
                os.fsync(file.fileno())
        try:
            built.rename(entry)
        except OSError:
            if not entry.is_dir():
                raise


def compiler() -> str:
    """Name of the C compiler."""
    return compiler_command()[0]


def compiler_command() -> list[str]:
    """The C compiler with its first arguments: $CC, or that of the Python interpreter."""
    return shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")

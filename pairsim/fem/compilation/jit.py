"""Cache and options of the just-in-time compilation of forms.

Forms are compiled for the instruction set of the processor (`-march=native`). The path of the cache contains a hash of
the processor's features, so that different machines with a common home folder do not share compiled code.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import platform
import shlex
import shutil
import sysconfig
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any


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


def cache() -> Path:
    """Folder of the compiled forms."""
    return Path(JIT_OPTIONS["cache_dir"])


def in_cache(name: str, build: Callable[[Path], None]) -> Path:
    """An entry of the cache, built unless it is there: whole, or not at all.

    It is built in another folder, written to the disk and renamed. Other processes therefore never see a part of it,
    and neither a process that is killed nor a full disk leaves one. If several build it, the first one's stays.

    Args:
        name: Its name, which determines its content.
        build: Writes its files into a new folder.

    Returns:
        Its folder.

    Raises:
        OSError: The cache cannot be written to; also errors of `build`.
    """
    entry = cache() / name
    if not entry.is_dir():
        cache().mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=UNFINISHED, dir=cache(), ignore_cleanup_errors=True) as place:
            built = Path(place) / name
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
    return entry


def use_temporary_cache() -> None:
    """Make the cache a new temporary folder, for this process and its children; it is removed when the process ends."""
    folder = tempfile.mkdtemp(prefix="pairsim-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ["XDG_CACHE_HOME"] = folder
    JIT_OPTIONS["cache_dir"] = _default()


def compiler() -> str:
    """Name of the C compiler that compiles forms: $CC, or that of the Python interpreter."""
    return shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")[0]

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
from collections.abc import Callable
from pathlib import Path
from typing import TypedDict

from pairsim.runtime.cache import cache_folder
from pairsim.runtime.errors import EnvironmentFailure


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace")
        flags = next((line for line in text.splitlines() if line.startswith(("flags", "Features"))), "")
    except OSError:
        flags = platform.processor()
    return hashlib.sha256((platform.machine() + flags).encode()).hexdigest()[:12]


def _default() -> str:
    return str(cache_folder() / _processor())


class JitOptions(TypedDict):
    """Options of the compiler of forms, as DOLFINx takes them."""

    cache_dir: str
    cffi_extra_compile_args: list[str]
    cffi_libraries: list[str]


JIT_OPTIONS: JitOptions = {
    "cache_dir": _default(),
    # -g0: Python adds its own -g, with which compilation takes 1.6 times as long and files are twelve times as large.
    "cffi_extra_compile_args": ["-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-g0"],
    "cffi_libraries": ["m"],
}
UNFINISHED = "unfinished"
"""Folder of the cache in which entries are built; a process that fails or is killed leaves it behind."""
LOCK = "lock"
"""Lock file of the cache, locked by the process that builds an entry."""
LOG = logging.getLogger(__name__)
"""Logs, at the level INFO, that an entry is missing and will be compiled."""
LOG.setLevel(logging.INFO)


def cache() -> Path:
    """Folder of the compiled forms."""
    return Path(JIT_OPTIONS["cache_dir"])


def in_cache(name: str, build: Callable[[Path], None]) -> Path:
    """Return an entry of the cache, building it if it is missing.

    It is built in another folder and renamed when complete, so that no process ever sees an incomplete entry, even if
    the process that builds it is killed. Only one process builds at a time.

    Args:
        name: Its name, which determines its content.
        build: Writes its files into a new folder.

    Returns:
        Its folder.

    Raises:
        EnvironmentFailure: There is no C compiler, or the cache cannot be written to; also what `build` raises.
    """
    from filelock import FileLock

    entry = cache() / name
    if entry.is_dir():
        return entry
    if shutil.which(compiler()) is None:
        advice = "apt install gcc libc6-dev, or the environment variable CC (docs/how-to/install.md)"
        raise EnvironmentFailure(f"there is no C compiler ({compiler()}), which compiles the forms", advice=advice)
    LOG.info(
        "compiling what this kind of scene needs, once: some twenty seconds, and as many more for each further mode"
    )
    try:
        cache().mkdir(parents=True, exist_ok=True)
        with FileLock(cache() / LOCK):
            shutil.rmtree(unfinished := cache() / UNFINISHED, ignore_errors=True)  # of a process that was killed
            if not entry.is_dir():
                unfinished.mkdir()
                build(unfinished)
                unfinished.rename(entry)
    except (OSError, UnicodeError) as error:  # FFCx writes the path into a file in UTF-8
        message = f"the cache of compiled forms, {cache()}, cannot be written ({getattr(error, 'strerror', error)})"
        advice = "another folder in the environment variable XDG_CACHE_HOME"
        raise EnvironmentFailure(message, advice=advice) from error
    return entry


def compiler() -> str:
    """Name of the C compiler."""
    return compiler_command()[0]


def compiler_command() -> list[str]:
    """The C compiler with its first arguments: $CC, or that of the Python interpreter."""
    return shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")

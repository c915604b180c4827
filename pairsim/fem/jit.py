"""Options of the just-in-time compilation of forms.

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


def cache() -> Path:
    """Folder of the compiled forms."""
    return Path(JIT_OPTIONS["cache_dir"])


def use_temporary_cache() -> None:
    """Make the cache a new temporary folder, for this process and its children; it is removed when the process ends."""
    folder = tempfile.mkdtemp(prefix="pairsim-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    adopt_cache(folder)


def adopt_cache(base: str) -> None:
    """Use the cache in another base folder (XDG_CACHE_HOME), for this process and its children."""
    os.environ["XDG_CACHE_HOME"] = base
    JIT_OPTIONS["cache_dir"] = _default()


def compiler() -> str:
    """Name of the C compiler that compiles forms: $CC, or that of the Python interpreter."""
    return shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")[0]

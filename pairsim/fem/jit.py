"""Options of the just-in-time compilation of forms.

Forms are compiled for the instruction set of the processor (`-march=native`). The path of the cache contains a hash of
the processor's features, so that different machines with a common home folder do not share compiled code.
"""

from __future__ import annotations

import hashlib
import os
import platform
from pathlib import Path


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace")
        flags = next((line for line in text.splitlines() if line.startswith(("flags", "Features"))), "")
    except OSError:
        flags = platform.processor()
    return hashlib.sha256((platform.machine() + flags).encode()).hexdigest()[:12]


def _cache() -> str:
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return str(base / "pairsim" / _processor())


JIT_OPTIONS = {
    "cache_dir": _cache(),
    "cffi_extra_compile_args": ["-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math"],
    "cffi_libraries": ["m"],
}

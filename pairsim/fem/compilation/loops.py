"""The compiled loops over cells in `cell_loop.c`, which assemble the matrix of the free unknowns.

They are compiled when one of them is first called, with the compiler and flags of the forms and into the same cache.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import shlex
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.fem.compilation.jit import JIT_OPTIONS, compiler_command, in_cache
from pairsim.runtime.errors import EnvironmentFailure

SOURCE = Path(__file__).with_name("cell_loop.c")
LIBRARY = "loops.so"


def _options() -> list[str]:
    return [*map(str, JIT_OPTIONS["cffi_extra_compile_args"]), "-std=c11", "-fPIC", "-shared"]


def _build(folder: Path) -> None:
    """Compile the library."""
    command = [*compiler_command(), *_options(), str(SOURCE), "-o", str(folder / LIBRARY)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise EnvironmentFailure(f"{shlex.join(done.args)} failed: {done.stderr.strip()}", advice="pairsim doctor")


def compile_loops() -> Path:
    """Compile the loops unless this was done before, and return the path of the library.

    The name of the library's folder contains a hash of the source and of the options, not of the compiler: a library in
    the cache is used with another compiler, or without one.

    Raises:
        EnvironmentFailure: There is no compiler, it failed, or the cache cannot be written to.
    """
    content = SOURCE.read_bytes() + shlex.join(_options()).encode()
    return in_cache(f"loops-{hashlib.sha256(content).hexdigest()[:16]}", _build) / LIBRARY


@functools.cache
def _loops() -> Any:
    loops = ctypes.CDLL(str(compile_loops()))
    loops.row_patterns.restype = ctypes.c_int64
    return loops


def _argument(value: Any) -> Any:
    """A value as an argument for C: a pointer for an array, int64_t for an int, int32_t for an np.int32."""
    if isinstance(value, np.ndarray):
        assert value.flags.c_contiguous
        return value.ctypes.data_as(ctypes.c_void_p)
    if isinstance(value, np.int32):
        return ctypes.c_int32(int(value))
    return ctypes.c_int64(value) if isinstance(value, int) else value


def call(name: str, *arguments: Any) -> int:
    """Call a compiled loop with arrays, int (int64_t), np.int32 (int32_t) or a pointer."""
    return int(getattr(_loops(), name)(*map(_argument, arguments)))

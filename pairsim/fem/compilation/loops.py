"""Compiled loops.

`cell_loop.c` assembles the matrix of the free unknowns, `patch_recovery.c` fits polynomials on patches of cells, and
`point_location.c` finds points in cells.

They are compiled when one is first called, with the compiler and flags of the forms and into the same cache.
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

SOURCES = tuple(Path(__file__).with_name(name) for name in ("cell_loop.c", "patch_recovery.c", "point_location.c"))
LIBRARY = "loops.so"


def _options() -> list[str]:
    return [*map(str, JIT_OPTIONS["cffi_extra_compile_args"]), "-std=c11", "-fPIC", "-shared"]


def _build(folder: Path) -> None:
    """Compile the library."""
    command = [*compiler_command(), *_options(), *map(str, SOURCES), "-o", str(folder / LIBRARY), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise EnvironmentFailure(f"{shlex.join(done.args)} failed: {done.stderr.strip()}", advice="pairsim doctor")


def compile_loops() -> Path:
    """Compile the loops unless this was done before, and return the path of the library.

    Another compiler, or none, makes no difference to a library that is there: the name of its folder contains a hash of
    the sources and of the options.

    Raises:
        EnvironmentFailure: There is no compiler, it failed, or the cache cannot be written to.
    """
    content = b"".join(each.read_bytes() for each in SOURCES) + shlex.join(_options()).encode()
    return in_cache(f"loops-{hashlib.sha256(content).hexdigest()[:16]}", _build) / LIBRARY


@functools.cache
def _loops() -> Any:
    loops = ctypes.CDLL(str(compile_loops()))
    loops.row_patterns.restype = loops.patch_nodes.restype = ctypes.c_int64
    for name in ("locate", "assemble", "find_triangles", "patch_fits"):
        getattr(loops, name).restype = ctypes.c_int
    return loops


def _argument(value: Any) -> Any:
    """A C argument: pointers of arrays, double and int64 for Python's numbers, int32 for integers of NumPy."""
    if isinstance(value, np.ndarray):
        assert value.flags.c_contiguous
        return value.ctypes.data_as(ctypes.c_void_p)
    if isinstance(value, np.int32):
        return ctypes.c_int32(int(value))
    if isinstance(value, float):
        return ctypes.c_double(value)
    return ctypes.c_int64(value) if isinstance(value, int) else value


def call(name: str, *arguments: Any) -> int:
    """Call a compiled loop with arrays, int (int64_t), np.int32 (int32_t), float, None (NULL) or a pointer."""
    return int(getattr(_loops(), name)(*map(_argument, arguments)))

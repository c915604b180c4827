"""Checks of the installation for `pairsim doctor`: what was found, and what to do where something is missing.

The libraries are loaded and tried in a child process (`python -P -m pairsim.api.doctor`), since a broken one may end
the process that loads it.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Literal

from pairsim.fem import form_cache, jit
from pairsim.runtime.child_process import clean_environment, module_command
from pairsim.runtime.errors import PairsimError
from pairsim.runtime.launcher import find_mpirun
from pairsim.runtime.version import __version__

ROOM = 500e6  # bytes of disk space below which there is a warning; chosen, enough for the forms and some runs
PATIENCE = 300.0  # seconds for the computation of the small case, which may compile a form; chosen
SMALL = {"particles": 0, "De": 0, "length": 1.0, "ends": "developed", "time": {"end": 1e-3}}
"""The case that is computed: the tube alone."""
PROGRAM = "#include <complex.h>\n#include <math.h>\ndouble twice(double x) { return 2 * sin(x); }\n"


@dataclass(frozen=True)
class Check:
    """The result of one check.

    Attributes:
        name: What was checked.
        status: "ok"; "warning": something optional is missing; "broken": cases cannot be computed.
        found: What was found.
        remedy: What to do, empty if it is in order.
    """

    name: str
    status: Literal["ok", "warning", "broken"]
    found: str
    remedy: str = ""


def checks() -> Iterator[Check]:
    """Carry out all checks; yields each result as soon as it is known."""
    yield Check("pairsim", "ok", f"{__version__} in {Path(__file__).parents[1]}")
    yield Check("Python", "ok", f"{platform.python_version()}, {sys.executable}")
    yield _compiler()
    yield _cache()
    yield _folder()
    yield _mpirun()
    yield from _libraries()
    yield _movies()


def _compiler() -> Check:
    """Whether the C compiler exists and compiles a small library."""
    name, remedy = jit.compiler(), "apt install gcc libc6-dev, or set the environment variable CC"
    path = shutil.which(name)
    if path is None:
        return Check("C compiler", "broken", f"{name} is not on PATH", remedy)
    with tempfile.TemporaryDirectory() as folder:
        words = [path, *jit.JIT_OPTIONS["cffi_extra_compile_args"], "-shared", "-fPIC", "-x", "c", "-"]
        done = subprocess.run(
            [*words, "-o", str(Path(folder) / "small.so"), "-lm"],
            input=PROGRAM,
            capture_output=True,
            text=True,
            check=False,
        )
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if "error" in line] or [f"exit code {done.returncode}"]
        return Check("C compiler", "broken", f"{path} fails: {lines[0]}", remedy)
    return Check("C compiler", "ok", path)


def _cache() -> Check:
    """Whether compiled forms can be kept."""
    why, folder = form_cache.why_not_writable(), jit.cache()
    if why:
        remedy = "set XDG_CACHE_HOME to a folder with write permission; until then forms are compiled in each run"
        return Check("cache of compiled forms", "warning", f"{folder}: {why}", remedy)
    size = sum(path.stat().st_size for path in folder.rglob("*"))
    free = shutil.disk_usage(folder).free
    found = f"{folder}, {size / 1e6:.0f} MB, {free / 1e9:.3g} GB free"
    if free < ROOM:
        return Check("cache of compiled forms", "warning", found, "free disk space, or set XDG_CACHE_HOME")
    return Check("cache of compiled forms", "ok", found)


def _folder() -> Check:
    """Whether results can be written into the current folder."""
    try:
        with tempfile.TemporaryFile(dir="."):
            pass
    except OSError as error:
        remedy = "give a folder with write permission with -o"
        return Check("current folder", "warning", f"{Path.cwd()}: {error.strerror}", remedy)
    free = shutil.disk_usage(".").free
    found = f"{Path.cwd()}, {free / 1e9:.3g} GB free"
    return Check("current folder", "warning" if free < ROOM else "ok", found, "free disk space" if free < ROOM else "")


def _mpirun() -> Check:
    """Whether there is an mpirun, and it is that of this Python."""
    path = find_mpirun()
    if path is None:
        return Check("mpirun", "warning", "none", "install the MPI of mpi4py for sweeps on several cores")
    if Path(path).parent != Path(sys.executable).parent:
        return Check("mpirun", "ok", f"{path}; it must be that of the MPI below")
    return Check("mpirun", "ok", path)


def _movies() -> Check:
    path = shutil.which("ffmpeg")
    return Check("ffmpeg (plot --animate)", "ok", path or "none: animations are GIF files")


def _libraries() -> Iterator[Check]:
    """Load the libraries and compute a small case, in a child process."""
    try:
        done = subprocess.run(
            module_command("pairsim.api.doctor"),
            env=clean_environment(),
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        output, complaint, code = done.stdout, done.stderr, done.returncode
    except subprocess.TimeoutExpired as late:
        so_far = late.stdout or b""
        output = so_far.decode() if isinstance(so_far, bytes) else so_far
        complaint, code = f"no answer in {PATIENCE:g} s", 1
    found = [Check(**json.loads(line)) for line in output.splitlines() if line.startswith("{")]
    yield from found
    if code:
        last = (complaint.strip().splitlines() or [f"exit code {code}"])[-1]
        why = f"ended by {signal.Signals(-code).name}" if code < 0 else last
        after = f"after {found[-1].name}" if found else "at once"
        yield Check("libraries", "broken", f"the check stopped {after}: {why}", "see docs/how-to/install.md")


def _loaded() -> Iterator[Check]:
    """Load each library and compute a small case, in this process."""

    def tried(name: str, attempt: Callable[[], str]) -> Check:
        try:
            return Check(name, "ok", attempt())
        except (PairsimError, ImportError) as error:
            return Check(name, "broken", str(error), "see docs/how-to/install.md")

    def fenicsx() -> str:
        from pairsim.runtime.fenicsx import PETSc, dolfinx

        if not dolfinx.__version__.startswith("0.11."):
            raise PairsimError(f"DOLFINx {dolfinx.__version__} where 0.11 is needed")
        return f"DOLFINx {dolfinx.__version__}, PETSc {'.'.join(map(str, PETSc.Sys.getVersion()))}"

    def mpi() -> str:
        from pairsim.runtime.mpi import MPI

        return MPI.Get_library_version().splitlines()[0].strip("\0 ")

    def pictures() -> str:
        from pairsim.plots.style import Page

        Page().figure(10.0).canvas.draw()
        return f"matplotlib {metadata.version('matplotlib')}, without a screen"

    def small() -> str:
        import pairsim

        result = pairsim.run(SMALL).check()
        drop, exact = result.table["dp"].iloc[-1], 32 * SMALL["length"]  # type: ignore[operator]
        if abs(drop - exact) > 1e-6 * exact:
            raise PairsimError(f"the pressure drop of the tube is {drop:g} instead of {exact:g}")
        return f"{result.record['unknowns']} unknowns in {result.record['wall_time']:.1f} s: dp = {drop:g}, exactly"

    yield tried("gmsh and FEniCSx", fenicsx)
    yield tried("MPI", mpi)
    yield tried("pictures", pictures)
    yield tried("a small case (gmsh, forms, MUMPS)", small)


if __name__ == "__main__":
    for check in _loaded():
        print(json.dumps(asdict(check)), flush=True)
    os._exit(0)  # what a library does at its end is no concern here

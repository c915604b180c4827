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
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Literal

from pairsim.fem import form_cache
from pairsim.fem.compilation import jit
from pairsim.runtime.child_process import clean_environment, module_command
from pairsim.runtime.errors import PairsimError
from pairsim.runtime.launcher import find_mpirun
from pairsim.runtime.version import __version__

ROOM = 500e6  # bytes of disk space below which there is a warning; chosen, enough for the forms and some runs
PATIENCE = 300.0  # seconds for the computation of the small case, which may compile a form; chosen
LENGTH = 1.0
SMALL = {"particles": 0, "De": 0, "length": LENGTH, "ends": "developed", "time": {"end": 1e-3}}
"""The case that is computed: the tube alone."""
PROGRAM = "#include <complex.h>\n#include <math.h>\ndouble twice(double x) { return 2 * sin(x); }\n"
INSTALL = "see docs/how-to/install.md"
Status = Literal["ok", "warning", "broken"]


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
    status: Status
    found: str
    remedy: str = ""


class Lacking(Exception):
    """What a check did not find, and what to do."""

    def __init__(self, found: str, remedy: str) -> None:
        super().__init__(found)
        self.remedy = remedy


def checks() -> Iterator[Check]:
    """Carry out all checks; yields each result as soon as it is known."""
    yield Check("pairsim", "ok", f"{__version__} in {Path(__file__).parents[1]}")
    yield Check("Python", "ok", f"{platform.python_version()}, {sys.executable}")
    yield _tried("C compiler", _compiler, "broken")
    yield _tried("cache of compiled forms", _cache, "warning")
    yield _tried("current folder", _folder, "warning")
    yield _tried("mpirun", _mpirun, "warning")
    yield from _libraries()
    yield Check("ffmpeg (plot --animate)", "ok", shutil.which("ffmpeg") or "none: animations are GIF files")


def _tried(name: str, attempt: Callable[[], str], without: Status) -> Check:
    """What an attempt found, or the status `without` it."""
    try:
        return Check(name, "ok", attempt())
    except Lacking as error:
        return Check(name, without, str(error), error.remedy)
    except (PairsimError, ImportError) as error:
        return Check(name, without, str(error), INSTALL)


def _compiler() -> str:
    """The C compiler, which compiles a small library."""
    name, remedy = jit.compiler(), "apt install gcc libc6-dev, or set the environment variable CC"
    path = shutil.which(name)
    if path is None:
        raise Lacking(f"{name} is not on PATH", remedy)
    with tempfile.TemporaryDirectory() as folder:
        words = [path, *jit.JIT_OPTIONS["cffi_extra_compile_args"], "-shared", "-fPIC", "-x", "c", "-", "-lm"]
        words += ["-o", f"{folder}/small.so"]
        done = subprocess.run(words, input=PROGRAM, capture_output=True, text=True, check=False)
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if "error" in line] or [f"exit code {done.returncode}"]
        raise Lacking(f"{path} fails: {lines[0]}", remedy)
    return path


def _cache() -> str:
    """The folder of compiled forms, which can be written to."""
    why, folder = form_cache.why_not_writable(), jit.cache()
    if why:
        remedy = "set XDG_CACHE_HOME to a folder with write permission; until then forms are compiled in each run"
        raise Lacking(f"{folder}: {why}", remedy)
    size = sum(path.stat().st_size for path in folder.rglob("*"))
    return _with_room(f"{folder}, {size / 1e6:.0f} MB", folder, "free disk space, or set XDG_CACHE_HOME")


def _folder() -> str:
    """The current folder, which can be written to."""
    try:
        with tempfile.TemporaryFile(dir="."):
            pass
    except OSError as error:
        raise Lacking(f"{Path.cwd()}: {error.strerror}", "give a folder with write permission with -o") from error
    return _with_room(str(Path.cwd()), Path(), "free disk space")


def _with_room(found: str, folder: Path, remedy: str) -> str:
    free = shutil.disk_usage(folder).free
    found = f"{found}, {free / 1e9:.3g} GB free"
    if free < ROOM:
        raise Lacking(found, remedy)
    return found


def _mpirun() -> str:
    """An mpirun, which should be that of this Python."""
    path = find_mpirun()
    if path is None:
        raise Lacking("none", "install the MPI of mpi4py for sweeps on several cores")
    return path if Path(path).parent == Path(sys.executable).parent else f"{path}; it must be that of the MPI below"


def _libraries() -> Iterator[Check]:
    """Load the libraries and compute a small case, in a child process."""
    command = module_command("pairsim.api.doctor")
    try:
        done = subprocess.run(
            command, env=clean_environment(), capture_output=True, text=True, timeout=PATIENCE, check=False
        )
    except subprocess.TimeoutExpired as late:
        output = late.stdout.decode() if isinstance(late.stdout, bytes) else late.stdout or ""
        done = subprocess.CompletedProcess(command, 1, output, f"no answer in {PATIENCE:g} s")
    found = [Check(**json.loads(line)) for line in done.stdout.splitlines() if line.startswith("{")]
    yield from found
    if code := done.returncode:
        last = (done.stderr.strip().splitlines() or [f"exit code {code}"])[-1]
        why = f"ended by {signal.Signals(-code).name}" if code < 0 else last
        after = f"after {found[-1].name}" if found else "at once"
        yield Check("libraries", "broken", f"the check stopped {after}: {why}", INSTALL)


def _fenicsx() -> str:
    from pairsim.runtime.fenicsx import PETSc, dolfinx

    with suppress(ModuleNotFoundError):
        import dolfinx_solver  # noqa: F401  # of the wheel: refuses a second PETSc beside its own

    if not dolfinx.__version__.startswith("0.11."):
        raise Lacking(f"DOLFINx {dolfinx.__version__} where 0.11 is needed", INSTALL)
    return f"DOLFINx {dolfinx.__version__}, PETSc {'.'.join(map(str, PETSc.Sys.getVersion()))}"


def _mpi() -> str:
    from pairsim.runtime.mpi import MPI

    return MPI.Get_library_version().splitlines()[0].strip("\0 ")


def _pictures() -> str:
    from pairsim.plots.style import Page

    Page().figure(10.0).canvas.draw()
    return f"matplotlib {metadata.version('matplotlib')}, without a screen"


def _small() -> str:
    import pairsim

    result = pairsim.run(SMALL).check()
    drop, exact = result.table["dp"].iloc[-1], 32 * LENGTH
    if abs(drop - exact) > 1e-6 * exact:
        raise Lacking(f"the pressure drop of the tube is {drop:g} instead of {exact:g}", INSTALL)
    return f"{result.record['unknowns']} unknowns in {result.record['wall_time']:.1f} s: dp = {drop:g}, exactly"


LIBRARIES = {
    "gmsh and FEniCSx": _fenicsx,
    "MPI": _mpi,
    "pictures": _pictures,
    "a small case (gmsh, forms, MUMPS)": _small,
}
"""What the child process tries, in this order."""

if __name__ == "__main__":
    for name, attempt in LIBRARIES.items():
        print(json.dumps(asdict(_tried(name, attempt, "broken"))), flush=True)
    os._exit(0)  # what a library does at its end is no concern here

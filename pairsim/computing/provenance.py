"""Entries of run.json on a process: its memory, versions and machine."""

from __future__ import annotations

import platform
import resource
import sys
import time
from functools import cache
from importlib import metadata
from pathlib import Path

from pairsim.record.run_entries import COMMAND, MACHINE, STARTED, VERSIONS, Entries
from pairsim.runtime.fenicsx import petsc_version
from pairsim.runtime.version import __version__


@cache
def _versions() -> dict[str, str]:
    names = ("fenics-basix", "fenics-ffcx", "fenics-ufl", "gmsh", "mpi4py", "numpy", "scipy", "h5py")
    found = {"pairsim": __version__, "python": platform.python_version(), "petsc": petsc_version()}
    for name in names:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "unknown"
    return found


def peak_memory() -> int:
    """Peak memory of this process so far, in bytes."""
    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return largest if sys.platform == "darwin" else 1024 * largest


def memory() -> int:
    """Memory of this process, in bytes; its peak so far if the system does not report the current value."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return peak_memory()
    return pages * resource.getpagesize()


def about(command: str) -> Entries:
    """The entries of run.json that do not depend on the case: when and with which command, machine and versions."""
    return {
        STARTED: time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        COMMAND: command,
        MACHINE: {"node": platform.node(), "system": platform.platform(), "processor": platform.machine()},
        VERSIONS: _versions(),
    }

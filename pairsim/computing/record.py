"""run.json: how a command ended, its duration and memory, versions and machine."""

from __future__ import annotations

import platform
import resource
import sys
import time
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pairsim.computing.events import Outcome
from pairsim.physics.scales import Scales
from pairsim.results.folder import RunFolder
from pairsim.runtime.errors import ENVIRONMENT, BranchEnd, EnvironmentFailure
from pairsim.runtime.fenicsx import petsc_version
from pairsim.runtime.version import __version__

EXIT_CODES = {"finished": 0, "failed": 3, "interrupted": 130}
"""Exit code of a command, by status."""
REASON_CODES = {EnvironmentFailure.reason: ENVIRONMENT, BranchEnd.reason: 5}
"""Exit codes of reasons that have their own."""


def exit_code(status: str, reason: str) -> int:
    """Exit code of a command.

    0 finished, 3 failed, 4 failed because of its environment, 5 finished without values as there is no steady state,
    130 interrupted.
    """
    return REASON_CODES.get(reason, EXIT_CODES[status])


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
    """Memory of this process, in bytes; its peak so far where the system does not tell."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return peak_memory()
    return pages * resource.getpagesize()


class Record:
    """Writes run.json, as a whole at each change.

    Args:
        folder: The folder of results.
        kind: The command that writes the folder: run, curve or critical.
        command: The command line.
        before: Wall time before the run was resumed [s].
        scales: The units of length, velocity and stress in SI units, None without a `physical` block.
        more: Entries that say what the case is.
    """

    def __init__(
        self,
        folder: RunFolder,
        kind: str,
        command: str,
        before: float = 0.0,
        scales: Scales | None = None,
        more: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        self._folder, self._kind, self._scales, self._more = folder, kind, scales, more
        self._command = command
        self._begin = time.perf_counter() - before
        self._started = time.strftime("%Y-%m-%dT%H:%M:%S%z")

    @property
    def passed(self) -> float:
        """Wall time of the command, including that before it was resumed [s]."""
        return time.perf_counter() - self._begin

    def write(self, outcome: Outcome | None, more: dict[str, Any], phases: dict[str, float]) -> None:
        """Write run.json.

        Args:
            outcome: How the command ended, None while it is running.
            more: Further entries.
            phases: Wall time of each phase [s]; the rest is written as `other`.

        Raises:
            OSError: The file cannot be written.
        """
        wall = self.passed
        content = {
            "kind": self._kind,
            "status": outcome.status if outcome else "running",
            "reason": outcome.reason if outcome else "",
            "message": outcome.message if outcome else "",
            "started": self._started,
            "command": self._command,
            "machine": {"node": platform.node(), "system": platform.platform(), "processor": platform.machine()},
            "versions": _versions(),
            "wall_time": wall,
            "peak_memory": peak_memory(),
            **self._more,
            **more,
        }
        if (scales := self._scales) is not None:
            names = ("length", "time", "velocity", "stress")
            content["scales"] = {name: getattr(scales, name) for name in names} | {"units": "m, s, m/s, Pa"}
        if phases:
            content["wall_time_by_phase"] = {**phases, "other": wall - sum(phases.values())}
        self._folder.write_json("run.json", content)

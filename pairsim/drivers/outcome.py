"""What every command leaves behind besides its numbers: how it ended, by which versions, on which machine."""

from __future__ import annotations

import platform
import resource
import sys
import time
from dataclasses import dataclass
from importlib import metadata
from typing import Any

from pairsim.physics.scales import Scales
from pairsim.results.output import FORMAT, RunFolder
from pairsim.runtime.version import __version__
from pairsim.solvers.newton import petsc_version

EXIT_CODES = {"finished": 0, "failed": 3, "interrupted": 130}
"""Exit codes of commands by status."""


@dataclass(frozen=True)
class Outcome:
    """How a command ended.

    Attributes:
        status: "finished", "failed" or "interrupted".
        reason: "end", "contact", "max_gap", or the typed reason of a failure.
        message: One line for people.
    """

    status: str
    reason: str
    message: str

    @property
    def exit_code(self) -> int:
        """0 finished, 3 typed failure, 130 interrupted."""
        return EXIT_CODES[self.status]


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
    """Most memory that this process has held so far, in bytes."""
    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return largest if sys.platform == "darwin" else 1024 * largest


class Record:
    """run.json: rewritten whole whenever there is news.

    Args:
        folder: The folder, None on all processes but the first.
        kind: The command that the folder is of: run, curve or critical.
        command: The command line.
        processes: Size of the communicator.
        before: Seconds that the run took before it was stopped and resumed.
        scales: The units of the case in SI units, None where it was given without units.
    """

    def __init__(
        self,
        folder: RunFolder | None,
        kind: str,
        command: str,
        processes: int,
        before: float = 0.0,
        scales: Scales | None = None,
    ) -> None:
        self._folder, self._kind, self._scales = folder, kind, scales
        self._command, self._processes = command, processes
        self._begin = time.perf_counter() - before
        self._started = time.strftime("%Y-%m-%dT%H:%M:%S%z")

    @property
    def passed(self) -> float:
        """Seconds since the command began, and those before a resume."""
        return time.perf_counter() - self._begin

    def write(self, outcome: Outcome | None, more: dict[str, Any], phases: dict[str, float]) -> None:
        """Write how it stands.

        Args:
            outcome: How it ended, None while it runs.
            more: Further entries.
            phases: Seconds by phase of the work; the rest is `other`.
        """
        if self._folder is None:
            return
        wall = self.passed
        content = {
            "format": FORMAT,
            "kind": self._kind,
            "status": outcome.status if outcome else "running",
            "reason": outcome.reason if outcome else "",
            "message": outcome.message if outcome else "",
            "started": self._started,
            "command": self._command,
            "processes": self._processes,
            "machine": {"node": platform.node(), "system": platform.platform(), "processor": platform.machine()},
            "versions": _versions(),
            "wall_time": wall,
            "peak_memory": peak_memory(),  # of the first process
            **more,
        }
        if (scales := self._scales) is not None:
            names = ("length", "time", "velocity", "stress")
            content["scales"] = {name: getattr(scales, name) for name in names} | {"units": "m, s, m/s, Pa"}
        if phases:
            content["wall_time_by_phase"] = {**phases, "other": wall - sum(phases.values())}
        self._folder.write_json("run.json", content)

"""Functions common to the scripts that measure wall times."""

from __future__ import annotations

import os
import platform
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pairsim.solvers.problems import Problem


def with_one_thread() -> None:
    """Restart the script with one thread per process; numpy reads the number of threads when it is loaded."""
    if os.environ.get("OMP_NUM_THREADS") != "1":
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | {"OMP_NUM_THREADS": "1"})


def every_matrix(problem: Problem) -> Problem:
    """The same problem with a new matrix, and its factorisation, in every Newton iteration."""
    from pairsim.solvers.nonlinear.renewal import MatrixPolicy

    every = MatrixPolicy(slow=0.0, other_step=-1.0, far=0.0)
    return replace(problem, newton=replace(problem.newton, matrix=every))


def machine() -> str:
    """Processor model and number of cores, as text."""
    info = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").is_file() else ""
    model = re.search(r"model name\s*:\s*(.*)", info)
    return f"{model[1] if model else platform.processor()}, {os.cpu_count()} cores"

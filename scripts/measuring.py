"""What the scripts that measure times share."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pairsim.solvers.problems import Problem


def with_one_thread() -> None:
    """Start the script again with one thread a process, which is settled when numpy is loaded."""
    if os.environ.get("OMP_NUM_THREADS") != "1":
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | {"OMP_NUM_THREADS": "1"})


def every_matrix(problem: Problem) -> Problem:
    """The same with a matrix and a factorisation in every Newton iteration."""
    from pairsim.solvers.newton_options import MatrixPolicy

    every = MatrixPolicy(slow=0.0, other_step=-1.0, far=0.0)
    return replace(problem, newton=replace(problem.newton, matrix=every))

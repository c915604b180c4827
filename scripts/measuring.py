"""What the scripts that measure times share."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch


def with_one_thread() -> None:
    """Start the script again with one thread a process, which is settled when numpy is loaded."""
    if os.environ.get("OMP_NUM_THREADS") != "1":
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | {"OMP_NUM_THREADS": "1"})


@contextmanager
def every_matrix() -> Iterator[None]:
    """A matrix and a factorisation in every Newton iteration of a transient."""
    import pairsim.runtime.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
    from pairsim.solvers import newton
    from pairsim.solvers import transient as marching

    with patch.multiple(newton, OTHER_STEP=-1.0, FAR=0.0), patch.multiple(marching, SLOW=0.0):
        yield

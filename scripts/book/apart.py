"""Computations in separate processes, as the threads in which parts are computed must not share solvers."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context

from book.study import Stopped
from pairsim.runtime.child_process import end_with_parent


def apart[**P, T](function: Callable[P, T], *values: P.args, **keys: P.kwargs) -> T:
    """The result of a module-level function, computed in a separate process.

    Raises:
        Stopped: The process was stopped.
    """
    with ProcessPoolExecutor(1, get_context("spawn"), end_with_parent) as process:
        try:
            return process.submit(function, *values, **keys).result()
        except (BrokenProcessPool, KeyboardInterrupt) as error:
            raise Stopped from error

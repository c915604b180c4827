"""SIGINT and SIGTERM as a flag that work looks at between its steps."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpi4py import MPI

_entered: list[Signals] = []


class Signals:
    """Notes SIGINT and SIGTERM while it is entered.

    Args:
        impatient: A second signal does not wait for the step to end: it raises KeyboardInterrupt.
        installed: Whether it does. Without, signals do what they did before: SIGINT raises KeyboardInterrupt.

    Attributes:
        number: The signal caught last, 0 before one.
    """

    def __init__(self, *, impatient: bool = False, installed: bool = True) -> None:
        self.number = 0
        self._impatient, self._installed = impatient, installed
        self._old: dict[int, Any] = {}

    def _catch(self, number: int, _: FrameType | None) -> None:
        if self.number and self._impatient:
            raise KeyboardInterrupt
        self.number = number

    def __enter__(self) -> Signals:
        if self._installed and threading.current_thread() is threading.main_thread():  # the only one that may
            for number in (signal.SIGINT, signal.SIGTERM):
                self._old[number] = signal.signal(number, self._catch)
        _entered.append(self)
        return self

    def __exit__(self, *_: object) -> None:
        _entered.remove(self)
        if _entered and self.number:
            _entered[-1].number = self.number  # what this work was too far on to heed
        for number, old in self._old.items():
            signal.signal(number, old)


@contextmanager
def sigterm_waits() -> Iterator[None]:
    """SIGTERM comes after this: METIS takes it for an error of its own, and MUMPS crashes on what it leaves."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    try:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def callback[**P, R](function: Callable[P, R]) -> Callable[P, R]:
    """A function for gmsh and PETSc to call, in whose code an exception would be lost.

    A KeyboardInterrupt, which ends the work where no handler is installed, is noted in its place, as a handler would
    do, and the function is called again.
    """

    @wraps(function)
    def call(*arguments: P.args, **named: P.kwargs) -> R:
        try:
            return function(*arguments, **named)
        except KeyboardInterrupt:
            if not _entered:
                raise
            _entered[-1].number = signal.SIGINT
            return function(*arguments, **named)

    return call


def heed(comm: MPI.Comm) -> None:
    """Between two solves: KeyboardInterrupt on every process once one of them has been asked to stop.

    An exception out of a signal's handler would be lost in the callbacks of gmsh and PETSc. Does nothing where nobody
    has entered `Signals`.
    """
    if _entered and any(comm.allgather(_entered[-1].number)):
        raise KeyboardInterrupt

"""SIGINT and SIGTERM as a flag that is checked between the steps of a computation."""

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
    """Context manager whose handlers record SIGINT and SIGTERM.

    Args:
        impatient: Whether a second signal raises KeyboardInterrupt at once, without waiting for the end of the step.
        installed: Whether handlers are installed. If not, signals keep their previous effect: by default SIGINT
            raises KeyboardInterrupt.

    Attributes:
        number: Number of the last signal caught, 0 if none.
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
        # Python allows signal handlers to be installed from the main thread only.
        if self._installed and threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._old[number] = signal.signal(number, self._catch)
        _entered.append(self)
        return self

    def __exit__(self, *_: object) -> None:
        _entered.remove(self)
        if _entered and self.number:
            _entered[-1].number = self.number  # pass a signal on that came too late to be handled in this context
        for number, old in self._old.items():
            signal.signal(number, old)


@contextmanager
def sigterm_waits() -> Iterator[None]:
    """Context that defers SIGTERM to its end.

    METIS installs its own handler for SIGTERM and treats the signal as an internal error, after which MUMPS crashes on
    the incomplete ordering.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    try:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def callback[**P, R](function: Callable[P, R]) -> Callable[P, R]:
    """Decorator for callbacks from gmsh and PETSc, whose compiled code does not propagate Python exceptions.

    A KeyboardInterrupt, which SIGINT raises where no handler is installed, is recorded as a handler of `Signals` would
    do, and the function is called again; `heed` raises it afterwards.
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
    """Raise KeyboardInterrupt on every process if one of them has received a signal; to be called between solves.

    Collective. Handlers only set a flag because exceptions do not propagate through the callbacks of gmsh and PETSc.
    Does nothing outside a `Signals` context.

    Raises:
        KeyboardInterrupt: A process has received SIGINT or SIGTERM.
    """
    if _entered and any(comm.allgather(_entered[-1].number)):
        raise KeyboardInterrupt

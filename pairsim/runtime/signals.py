"""SIGINT, SIGTERM and SIGHUP as a flag that is checked between the steps and iterations of a computation."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # signals at which a command writes its results and ends


def name_of(number: int) -> str:
    """The name of a signal; SIGINT is called by its key, Ctrl-C."""
    return "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name


class Stopped(KeyboardInterrupt):
    """A signal has stopped the computation between two solves.

    Any other KeyboardInterrupt may have been raised at any point.
    """


class Signals:
    """Context manager whose handlers record signals: SIGINT, SIGTERM, and SIGHUP unless it was ignored (by nohup).

    Exceptions from handlers would be lost in the callbacks of compiled code. A second SIGINT (Ctrl-C) raises
    KeyboardInterrupt at once. Further SIGTERMs change nothing: schedulers and launchers send several, and the first one
    already ends the computation with its results written.

    Args:
        final: Whether the process ends with this context. After any signal, SIGTERM and SIGHUP are then ignored for
            good, so that they do not interrupt what the interpreter and MPI do at the end of a process.

    Attributes:
        number: Number of the last signal caught, 0 if none.
    """

    def __init__(self, *, final: bool = False) -> None:
        self.number = 0
        self._final, self._interrupts = final, 0
        self._old: dict[int, Any] = {}

    def _catch(self, number: int, _: FrameType | None) -> None:
        self.number = number
        if number == signal.SIGINT:
            self._interrupts += 1
            if self._interrupts > 1:
                raise KeyboardInterrupt

    def __enter__(self) -> Signals:
        # Python allows signal handlers to be installed from the main thread only.
        if threading.current_thread() is threading.main_thread():
            for number in ENDING:
                if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
                    self._old[number] = signal.signal(number, self._catch)
        return self

    def __exit__(self, *_: object) -> None:
        for number, old in self._old.items():
            ignored = self._final and self.number and number != signal.SIGINT
            signal.signal(number, signal.SIG_IGN if ignored else old)

    def check(self) -> None:
        """Raise `Stopped` if a signal was caught."""
        if self.number:
            raise Stopped(name_of(self.number))


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

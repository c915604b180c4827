"""SIGINT and SIGTERM as a flag that is checked between the steps and iterations of a computation."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from types import FrameType
from typing import Any

AGAIN = 0.01  # time after which an interrupt that Python has ignored is sent again [s]; chosen
_entered: list[Signals] = []


class Stopped(KeyboardInterrupt):
    """A signal has stopped the computation between two solves.

    A KeyboardInterrupt of another kind may have come anywhere.
    """


@contextmanager
def no_interrupt_lost() -> Iterator[None]:
    """Context, or decorator of a function, in which every Ctrl-C has an effect.

    Where an exception cannot be raised, as in destructors, callbacks of weak references (there is one for each import)
    and callbacks from compiled code, Python ignores it, a KeyboardInterrupt as well. SIGINT is then sent again a moment
    later, until it comes in ordinary code.
    """
    before = sys.unraisablehook

    def send_again(ignored: sys.UnraisableHookArgs) -> None:
        if not issubclass(ignored.exc_type, KeyboardInterrupt):
            before(ignored)
            return
        timer = threading.Timer(AGAIN, signal.pthread_kill, (threading.main_thread().ident, signal.SIGINT))
        timer.daemon = True
        timer.start()

    sys.unraisablehook = send_again
    try:
        yield
    finally:
        sys.unraisablehook = before


class Signals:
    """Context manager whose handlers record SIGINT and SIGTERM.

    Further SIGTERMs change nothing: schedulers and launchers send several, and the first one already ends the
    computation in order. No SIGINT is lost in a destructor (`no_interrupt_lost`).

    Args:
        impatient: Whether a second SIGINT (Ctrl-C) raises KeyboardInterrupt at once.
        installed: Whether handlers are installed. If not, signals keep their previous effect: by default SIGINT
            raises KeyboardInterrupt.
        final: Whether the process ends with this context. After a signal, SIGTERM is then ignored for good, so that it
            does not interrupt what the interpreter and MPI do at the end of a process.

    Attributes:
        number: Number of the last signal caught, 0 if none; one that an outer context has caught counts as well.
    """

    def __init__(self, *, impatient: bool = False, installed: bool = True, final: bool = False) -> None:
        self.number: int = received()
        self._impatient, self._installed, self._final = impatient, installed, final
        self._interrupts = 0
        self._old: dict[int, Any] = {}
        self._none_lost = no_interrupt_lost()

    def _catch(self, number: int, _: FrameType | None) -> None:
        self.number = number
        if number == signal.SIGINT:
            self._interrupts += 1
            if self._interrupts > 1 and self._impatient:
                raise KeyboardInterrupt

    def __enter__(self) -> Signals:
        # Python allows signal handlers to be installed from the main thread only.
        if self._installed and threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._old[number] = signal.signal(number, self._catch)
        self._none_lost.__enter__()
        _entered.append(self)
        return self

    def __exit__(self, *_: object) -> None:
        _entered.remove(self)
        self._none_lost.__exit__(None, None, None)
        if _entered and self.number:
            _entered[-1].number = self.number  # pass a signal on that came too late to be handled in this context
        for number, old in self._old.items():
            ignored = self._final and self.number and number == signal.SIGTERM
            signal.signal(number, signal.SIG_IGN if ignored else old)


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


def received() -> int:
    """Number of a signal that this process has received, 0 if none, or outside a `Signals` context."""
    return _entered[-1].number if _entered else 0


def heed() -> None:
    """Raise `Stopped` if this process has received a signal; to be called between solves.

    Handlers only set a flag because exceptions do not propagate through the callbacks of gmsh and PETSc. Does nothing
    outside a `Signals` context.

    Raises:
        Stopped: The process has received SIGINT or SIGTERM.
    """
    if number := received():
        raise Stopped(signal.Signals(number).name)

"""How long a computation may take, and who is told how far it is, between two solves."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from pairsim.runtime.duration import duration
from pairsim.runtime.errors import BudgetSpent

_deadlines: list[tuple[float, str]] = []
_listeners: list[Callable[[str], None]] = []
_way: list[str] = []  # the places on the way to the first result


@contextmanager
def budget(seconds: float | None, message: str = "the budget of {} is spent") -> Iterator[None]:
    """Context in which `within_budget` fails once so many seconds of wall time have passed; None sets no limit.

    Args:
        seconds: The limit [s].
        message: What is said then, with {} for the limit.
    """
    entry = (time.monotonic() + seconds, message.format(duration(seconds))) if seconds is not None else None
    if entry is None:
        yield
        return
    _deadlines.append(entry)
    try:
        yield
    finally:
        _deadlines.remove(entry)


def within_budget() -> None:
    """Raise if a budget is spent; to be called between solves.

    Raises:
        BudgetSpent: It is.
    """
    for deadline, message in _deadlines:
        if time.monotonic() > deadline:
            on_the_way = f", on the way at {_way[-1]}" if _way else ""
            raise BudgetSpent(f"{message}{on_the_way}", advice="a larger --budget")


@contextmanager
def told(listener: Callable[[str], None]) -> Iterator[None]:
    """Context in which a listener is told where a computation is, that has no result to show yet."""
    _listeners.append(listener)
    _way.clear()
    try:
        yield
    finally:
        _listeners.remove(listener)
        _way.clear()


def reached(place: str) -> None:
    """Tell where the computation is."""
    _way[:] = [place]
    for listener in _listeners[-1:]:
        listener(place)


def arrived() -> None:
    """Forget the way: there is a result."""
    _way.clear()

"""How long a computation may take, and who is told how far it is, between two solves."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from pairsim.runtime.duration import duration
from pairsim.runtime.errors import BudgetSpent

_deadlines: list[tuple[float, float]] = []
_listeners: list[Callable[[str], None]] = []


@contextmanager
def budget(seconds: float | None) -> Iterator[None]:
    """Context in which `within_budget` fails once so many seconds of wall time have passed; None sets no limit."""
    entry = (time.monotonic() + seconds, seconds) if seconds is not None else None
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
    for deadline, seconds in _deadlines:
        if time.monotonic() > deadline:
            raise BudgetSpent(f"the budget of {duration(seconds)} is spent", advice="a larger --budget")


@contextmanager
def told(listener: Callable[[str], None]) -> Iterator[None]:
    """Context in which a listener is told where a computation is, that has no result to show yet."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def reached(place: str) -> None:
    """Tell where the computation is."""
    for listener in _listeners[-1:]:
        listener(place)

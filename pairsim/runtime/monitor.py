"""The monitor of a computation: ends it between two solves, and hears where it is."""

from __future__ import annotations

import time
from collections.abc import Callable

from pairsim.runtime.errors import BudgetSpent
from pairsim.runtime.message import Message, Text
from pairsim.runtime.signals import Signals
from pairsim.runtime.text import duration


class Monitor:
    """What a computation asks between two solves whether it may go on, and tells where it is.

    It is handed down as an attribute of the problem. The default one lets every computation go on.

    Args:
        signals: The signals that end the computation.
        budget: Largest wall time of the computation [s], None for no limit.
        patience: Largest wall time up to the first result [s], None for no limit.
        listener: Function that is called with the place where the computation is, such as "De = 1, d = 0.1".
    """

    def __init__(
        self,
        signals: Signals | None = None,
        *,
        budget: float | None = None,
        patience: float | None = None,
        listener: Callable[[Text], None] | None = None,
    ) -> None:
        self._signals, self._listener = signals, listener
        self._place: Text = ""
        self._limits = [_limit(budget, "the budget of {} is spent")] if budget is not None else []
        self._patience = [_limit(patience, "nothing was found within {}")] if patience is not None else []

    def within(self, seconds: float, message: str) -> Monitor:
        """The monitor of a part of the computation, which has a limit of its own, too.

        Args:
            seconds: Largest wall time of the part [s].
            message: What is said when it is over, with {} for the time.
        """
        part = Monitor(self._signals, listener=self._listener)
        part._limits, part._patience = [*self._limits, _limit(seconds, message)], self._patience
        return part

    @property
    def left(self) -> float | None:
        """Wall time until the first of the limits [s]; None where there is none."""
        deadlines = [deadline for deadline, _ in self._limits]
        return max(min(deadlines) - time.monotonic(), 0.0) if deadlines else None

    def check_signals(self) -> None:
        """Raise `Stopped` if the process has received a signal; to be called before long operations."""
        if self._signals is not None:
            self._signals.check()

    def check(self) -> None:
        """Raise if the computation must end; to be called between solves.

        Raises:
            Stopped: The process has received a signal.
            BudgetSpent: A limit of the wall time has passed.
        """
        self.check_signals()
        for deadline, message in (*self._limits, *self._patience):
            if time.monotonic() > deadline:
                said = Message("{}, while solving at {}", message, self._place) if self._place else message
                raise BudgetSpent(said, advice="a larger --budget")

    def at(self, place: Text) -> None:
        """Tell where the computation is."""
        self._place = place
        if self._listener is not None:
            self._listener(place)

    @property
    def awaits_result(self) -> bool:
        """Whether the computation ends if it has no result for long."""
        return bool(self._patience)

    def has_result(self) -> None:
        """Tell that there is a result: the limit up to the first one ends, and messages do not name the way to it."""
        self._place = ""
        self._patience.clear()


def _limit(seconds: float, message: str) -> tuple[float, str]:
    """A limit: the time on the clock at which so many seconds have passed, and what is then said."""
    return time.monotonic() + seconds, message.format(duration(seconds))

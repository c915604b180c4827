"""The monitor of a computation: it ends the computation between two solves, follows its progress and times it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

from pairsim.runtime.errors import BudgetSpent
from pairsim.runtime.message import Message, Text
from pairsim.runtime.signals import Signals
from pairsim.runtime.text import duration


class Monitor:
    """The object that a computation asks between two solves whether it may go on, and tells where it is.

    Solvers receive it as an attribute of their problem. A monitor made without arguments never ends a computation.

    Args:
        signals: The signals that end the computation.
        budget: Largest wall time of the computation [s], None for no limit.
        patience: Largest processor time of this process up to the first result [s], None for no limit; not wall time,
            so that the outcome does not depend on the load of the machine.
        listener: Function that is called with the place where the computation is, such as "De = 1, d = 0.1".
        before: Wall time of the computation before it was resumed [s].
    """

    def __init__(
        self,
        signals: Signals | None = None,
        *,
        budget: float | None = None,
        patience: float | None = None,
        listener: Callable[[Text], None] | None = None,
        before: float = 0.0,
    ) -> None:
        self._signals, self._listener = signals, listener
        self._begun, self._before = time.monotonic(), before
        self._place: Text = ""
        self._limits = [_Limit.of(time.monotonic, budget, "the budget of {} is spent")] if budget is not None else []
        found_nothing = "nothing was found within {} of processor time"
        self._patience = [_Limit.of(time.process_time, patience, found_nothing)] if patience is not None else []
        self._result = _Result()

    def within(self, seconds: float, message: str, *, of_processor: bool = False) -> Monitor:
        """The monitor of a part of the computation: it has the limits of this one and one more.

        Args:
            seconds: Largest time of the part [s].
            message: The message once this time has passed, with {} in place of the time.
            of_processor: Whether processor time of this process is limited; otherwise it is wall time.
        """
        clock = time.process_time if of_processor else time.monotonic
        part = Monitor(self._signals, listener=self._listener, before=self._before)
        part._begun = self._begun
        part._limits = [*self._limits, _Limit.of(clock, seconds, message)]
        part._patience, part._result = self._patience, self._result
        return part

    @property
    def passed(self) -> float:
        """Wall time of the computation so far, without that before it was resumed [s]."""
        return time.monotonic() - self._begun

    @property
    def wall_time(self) -> float:
        """Wall time of the computation so far, with that before it was resumed [s]."""
        return self._before + self.passed

    @property
    def left(self) -> float | None:
        """Wall time until the first of the limits on it [s]; None where there is none."""
        left = [limit.left for limit in self._limits if limit.clock is time.monotonic]
        return max(min(left), 0.0) if left else None

    def check_signals(self) -> None:
        """Raise `Stopped` if the process has received a signal; to be called before long operations."""
        if self._signals is not None:
            self._signals.check()

    def check(self) -> None:
        """Raise if the computation must end; to be called between solves.

        Raises:
            Stopped: The process has received a signal.
            BudgetSpent: A time limit has passed.
        """
        self.check_signals()
        for limit in (*self._limits, *self._patience):
            if limit.left < 0:
                said = Message("{}, while solving at {}", limit.message, self._place) if self._place else limit.message
                raise BudgetSpent(said, advice="a larger --budget")

    def at(self, place: Text) -> None:
        """Tell where the computation is."""
        self._place = place
        if self._listener is not None:
            self._listener(place)

    @property
    def awaits_result(self) -> bool:
        """Whether the time up to the first result is limited."""
        return bool(self._patience)

    def has_result(self) -> None:
        """Record that there is a result: the limit on the time to the first one is lifted, and the place forgotten."""
        self._place = ""
        self._patience.clear()
        self._result.known = True

    @property
    def knows_result(self) -> bool:
        """Whether there is a result, even if finer cells may still improve it."""
        return self._result.known


@dataclass
class _Result:
    """Whether there is a result; shared by the monitors of a computation and of its parts."""

    known: bool = False


@dataclass(frozen=True)
class _Limit:
    """A limit on the time of a computation."""

    clock: Callable[[], float]  # [s]
    deadline: float  # reading of this clock at which the computation ends [s]
    message: str  # of the exception that ends it

    @classmethod
    def of(cls, clock: Callable[[], float], seconds: float, message: str) -> Self:
        """The limit that many seconds from now; {} in the message stands for their number."""
        return cls(clock, clock() + seconds, message.format(duration(seconds)))

    @property
    def left(self) -> float:
        """The time until the deadline [s], negative once it has passed."""
        return self.deadline - self.clock()

"""SIGINT and SIGTERM as a flag that work looks at between its steps."""

from __future__ import annotations

import signal
from types import FrameType
from typing import Any


class Signals:
    """Notes SIGINT and SIGTERM while it is entered.

    Args:
        impatient: A second signal does not wait for the step to end: it raises KeyboardInterrupt.

    Attributes:
        number: The signal caught last, 0 before one.
    """

    def __init__(self, *, impatient: bool = False) -> None:
        self.number = 0
        self._impatient = impatient
        self._old: dict[int, Any] = {}

    def _catch(self, number: int, _: FrameType | None) -> None:
        if self.number and self._impatient:
            raise KeyboardInterrupt
        self.number = number

    def __enter__(self) -> Signals:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._old[number] = signal.signal(number, self._catch)
        return self

    def __exit__(self, *_: object) -> None:
        for number, old in self._old.items():
            signal.signal(number, old)

"""Lines on stderr that show the progress of a computation."""

from __future__ import annotations

import sys
import time
from contextlib import suppress

from pairsim.runtime.text import duration

LINE_EVERY = 5.0  # seconds between lines


class Reporter:
    """Shows the progress of a computation if `shown`, otherwise nothing.

    There is a line for a step or point every few seconds: percent, the solution in words, time so far, and time left.
    """

    title = ""

    def __init__(self, shown: bool = False) -> None:
        self.shown = shown

    def start(self, title: str, goal: str, total: float) -> None:
        """Begin a case of this name, with its goal in words and as a number, see `pairsim.computing.events.Begin`."""
        self.title, self.total, self.begin = title, total, time.monotonic()
        self.last = self.line = self.begin  # when the last step or point was shown, and the last line
        self.part = 0.0
        self.say(f"{title}: {goal}")

    def say(self, text: str) -> None:
        """Show a line of text, or several."""
        if self.shown:
            with suppress(OSError):  # a computation goes on if its terminal is gone
                print(text, file=sys.stderr, flush=True)

    def update(self, done: float, text: str, count: int) -> None:
        """Show an accepted step or point, the count-th one."""
        now = time.monotonic()
        if count > 1 and now - self.line < LINE_EVERY:
            return
        part = min(done / self.total, 1.0)
        # From the pace since the last line: steps grow, and by the pace since the start it would be hours.
        pace = (part - self.part) / (now - self.last) if now > self.last else 0.0
        left = f", {duration((1 - part) / pace)} left" if 0.01 < part < 1 and pace > 0 else ""
        self.last = self.line = now
        self.part = part
        self.say(f"  {part:4.0%}  {text}  ({duration(now - self.begin)}{left})")

    def on_the_way(self, place: str, *, known: bool = False) -> None:
        """Show where a computation is while it has no new step or point; `known`: it is improving one that it has."""
        if (now := time.monotonic()) - self.line >= LINE_EVERY:
            self.line = now
            begun = bool(self.part) or known
            first = f"  {self.part:4.0%}  working on" if begun else "no result yet, solving easier cases first"
            self.say(f"{first}: {place}")

    def case(self, count: int, text: str) -> None:
        """Show that a case of a sweep has ended, the count-th one."""
        self.say(f"[{count}/{self.total:.0f}] {text}")

    def note(self, text: str) -> None:
        """Show a message that the user should see."""
        self.say(f"{self.title}: note: {text}" if self.title else text)

    def finish(self, text: str) -> None:
        """End with a line."""
        self.say(f"{self.title}: {text}" if self.title else text)

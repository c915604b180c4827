"""What a person sees on stderr while a computation goes on: lines, or nothing."""

from __future__ import annotations

import sys
import time
from contextlib import suppress

from pairsim.runtime.text import duration

LINE_EVERY = 5.0  # seconds between lines


class Reporter:
    """Shows nothing; the base of `LineReporter`."""

    title = ""

    def start(self, title: str, goal: str, total: float) -> None:
        """Begin.

        Args:
            title: Name of the case.
            goal: What is to be reached, in words.
            total: The same as a number; `update` says how much of it is done.
        """
        self.title, self.total, self.begin = title, total, time.monotonic()
        self.say(f"{title}: {goal}")

    def say(self, text: str) -> None:
        """Show a line of text that stays, or several."""

    def update(self, done: float, text: str, count: int) -> None:
        """Show an accepted step or point, the count-th one."""

    def on_the_way(self, place: str) -> None:
        """Show where a computation is that has no step or point to show yet."""

    def case(self, count: int, text: str) -> None:
        """Show that a case of a sweep has ended, the count-th one."""
        self.say(f"[{count}/{self.total:.0f}] {text}")

    def note(self, text: str) -> None:
        """Show what the user should know."""
        self.say(f"{self.title}: note: {text}" if self.title else text)

    def finish(self, text: str) -> None:
        """End with a line."""
        self.say(f"{self.title}: {text}" if self.title else text)


class LineReporter(Reporter):
    """Lines. Steps now and then: percent, state of the solution, seconds so far, seconds left."""

    def start(self, title: str, goal: str, total: float) -> None:
        super().start(title, goal, total)
        self.last, self.part = self.begin, 0.0

    def say(self, text: str) -> None:
        with suppress(OSError):  # a terminal that is gone is not worth a computation
            print(text, file=sys.stderr, flush=True)

    def on_the_way(self, place: str) -> None:
        if (now := time.monotonic()) - self.last >= LINE_EVERY:
            self.last = now
            self.say(f"on the way: {place}")

    def update(self, done: float, text: str, count: int) -> None:
        now = time.monotonic()
        if count > 1 and now - self.last < LINE_EVERY:
            return
        part = min(done / self.total, 1.0)
        # At the pace since the last line: steps grow, and those of the start would foretell hours.
        pace = (part - self.part) / (now - self.last) if now > self.last else 0.0
        left = f", {duration((1 - part) / pace)} left" if 0.01 < part < 1 and pace > 0 else ""
        self.last, self.part = now, part
        self.say(f"  {part:4.0%}  {text}  ({duration(now - self.begin)}{left})")


def make_reporter(shown: bool) -> Reporter:
    """What shows progress, or does not."""
    return LineReporter() if shown else Reporter()

"""What a person sees on stderr while a computation goes on: a live bar on a terminal, lines elsewhere, or nothing."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from typing import Literal, get_args

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Column
from rich.text import Text

from pairsim.runtime.errors import InputError
from pairsim.runtime.signals import sigterm_waits
from pairsim.runtime.text import duration

Style = Literal["auto", "bar", "lines", "none"]
"""How progress is shown; auto: a bar on a terminal, lines elsewhere."""
LINE_EVERY = 5.0  # seconds between plain lines


class Reporter:
    """Shows nothing; the base of the others."""

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

    def case(self, count: int, text: str, failed: bool) -> None:
        """Show that a case of a sweep has ended, the count-th one."""
        self.say(f"[{count}/{self.total:.0f}] {text}")

    def note(self, text: str) -> None:
        """Show what the user should know."""
        self.say(f"{self.title}: note: {text}" if self.title else text)

    def stop(self) -> None:
        """End without a line."""

    def finish(self, text: str) -> None:
        """End with a line."""
        self.stop()
        self.say(f"{self.title}: {text}" if self.title else text)


class LineReporter(Reporter):
    """Lines for logs. Steps now and then: percent, state of the solution, seconds so far, seconds left."""

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


class BarReporter(Reporter):
    """A live bar, and below it the state of the solution; both fit a terminal of 80 columns."""

    def __init__(self) -> None:
        self.console = Console(stderr=True)

    def start(self, title: str, goal: str, total: float) -> None:
        self.title, self.total = title, total
        self.bar = Progress(
            TextColumn("[bold]{task.description}", table_column=Column(no_wrap=True, ratio=1)),
            BarColumn(bar_width=20),
            TextColumn("{task.percentage:3.0f} %"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            expand=True,
        )
        self.task = self.bar.add_task(title, total=total)
        self.live = Live(self._view(goal), console=self.console, refresh_per_second=4)
        with sigterm_waits():  # the thread that draws does not take it
            self.live.start()

    def say(self, text: str) -> None:
        with suppress(OSError):  # as of lines
            self.console.print(Text(text))

    def update(self, done: float, text: str, count: int) -> None:
        self.bar.update(self.task, completed=done)
        self.live.update(self._view(text))

    def on_the_way(self, place: str) -> None:
        self.live.update(self._view(f"on the way: {place}"))

    def case(self, count: int, text: str, failed: bool) -> None:
        self.update(count, text, count)
        if failed:
            super().case(count, text, failed)

    def stop(self) -> None:
        with suppress(OSError):  # as of lines
            self.live.stop()

    def _view(self, state: str) -> Group:
        return Group(self.bar, Text(f"  {state}", style="dim", no_wrap=True, overflow="ellipsis"))


def style_of(progress: bool | Style) -> Style:
    """The style of a computation that is asked to show progress, or not.

    Raises:
        InputError: There is no such style.
    """
    if isinstance(progress, bool):
        return "auto" if progress else "none"
    if progress not in get_args(Style):
        raise InputError("progress", "", progress, f"must be true, false, or one of {', '.join(get_args(Style))}")
    return progress


def make_reporter(style: Style) -> Reporter:
    """The reporter of a style."""
    if style == "none":
        return Reporter()
    bar = style == "bar" or (style == "auto" and sys.stderr.isatty())
    return BarReporter() if bar else LineReporter()

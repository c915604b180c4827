"""What a person sees while a run goes on: a live bar on a terminal, a line now and then elsewhere, or nothing."""

from __future__ import annotations

import sys
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from pairsim.runtime.signals import sigterm_waits

LINE_EVERY = 5.0  # seconds between plain lines


class Reporter:
    """Shows nothing; the base of the others."""

    def start(self, title: str, goal: str, total: float) -> None:
        """Begin.

        Args:
            title: Name of the case.
            goal: What is to be reached, in words.
            total: The same as a number; `update` says how much of it is done.
        """

    def update(self, done: float, text: str, count: int) -> None:
        """Show an accepted step or point, the count-th one."""

    def note(self, text: str) -> None:
        """Show what the user should know."""

    def finish(self, text: str) -> None:
        """End with a line."""


class PlainReporter(Reporter):
    """A line now and then on stderr, for logs."""

    def __init__(self) -> None:
        self._last = 0.0

    def start(self, title: str, goal: str, total: float) -> None:
        self._title, self._begin = title, time.monotonic()
        print(f"{title}: {goal}", file=sys.stderr, flush=True)

    def update(self, done: float, text: str, count: int) -> None:
        now = time.monotonic()
        if count > 1 and now - self._last < LINE_EVERY:
            return
        self._last = now
        print(f"  {text}  {now - self._begin:.0f} s", file=sys.stderr, flush=True)

    def note(self, text: str) -> None:
        print(f"{self._title}: note: {text}", file=sys.stderr, flush=True)

    def finish(self, text: str) -> None:
        print(f"{self._title}: {text}", file=sys.stderr, flush=True)


class RichReporter(Reporter):
    """A live bar with the state of the solution and the time left."""

    def start(self, title: str, goal: str, total: float) -> None:
        self._title = title
        self._progress = Progress(
            TextColumn("[bold]{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[state]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )
        self._task: TaskID = self._progress.add_task(title, total=total, state="meshing")
        with sigterm_waits():  # the thread that draws does not take it
            self._progress.start()

    def update(self, done: float, text: str, count: int) -> None:
        self._progress.update(self._task, completed=done, state=text)

    def note(self, text: str) -> None:
        self._progress.console.print(f"{self._title}: note: {text}", highlight=False)

    def finish(self, text: str) -> None:
        self._progress.stop()
        Console(stderr=True).print(f"{self._title}: {text}", highlight=False)


def make_reporter(quiet: bool, rank: int) -> Reporter:
    """The reporter that fits: none on other processes or when quiet, live only on a terminal."""
    if quiet or rank > 0:
        return Reporter()
    return RichReporter() if sys.stderr.isatty() else PlainReporter()

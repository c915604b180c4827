"""What a person sees while a run goes on: a live bar on a terminal, a line now and then elsewhere, or nothing."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from typing import Any, Literal, get_args

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Column
from rich.text import Text

from pairsim.runtime.duration import duration
from pairsim.runtime.errors import InputError
from pairsim.runtime.signals import sigterm_waits

Style = Literal["auto", "bar", "lines", "json", "none"]
"""How progress is shown; auto: a bar on a terminal, lines elsewhere."""
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

    def answer(self, text: str, status: str, warnings: Sequence[str]) -> None:
        """Show the answer, which has the warnings in its text."""


class LineReporter(Reporter):
    """A line now and then on stderr, for logs: percent done, the state of the solution, seconds, and those left."""

    def start(self, title: str, goal: str, total: float) -> None:
        self._title, self._total, self._begin = title, total, time.monotonic()
        self._last, self._part = self._begin, 0.0
        self._say(f"{title}: {goal}")

    def update(self, done: float, text: str, count: int) -> None:
        now = time.monotonic()
        if count > 1 and now - self._last < LINE_EVERY:
            return
        part, passed = min(done / self._total, 1.0), now - self._begin
        # At the pace since the last line: steps grow, and those of the start would foretell hours.
        pace = (part - self._part) / (now - self._last) if now > self._last else 0.0
        left = f", {duration((1 - part) / pace)} left" if 0.01 < part < 1 and pace > 0 else ""
        self._last, self._part = now, part
        self._say(f"  {part:4.0%}  {text}  ({duration(passed)}{left})")

    def note(self, text: str) -> None:
        self._say(f"{self._title}: note: {text}")

    def finish(self, text: str) -> None:
        self._say(f"{self._title}: {text}")

    def _say(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    def answer(self, text: str, status: str, warnings: Sequence[str]) -> None:
        self._say(text)


class JsonReporter(Reporter):
    """A JSON object a line on stderr, for programs: `event` is start, progress, note, finish or answer."""

    def start(self, title: str, goal: str, total: float) -> None:
        self._title, self._total, self._begin = title, total, time.monotonic()
        self._say("start", goal=goal, total=total)

    def update(self, done: float, text: str, count: int) -> None:
        part = min(done / self._total, 1.0)
        self._say("progress", done=done, fraction=part, count=count, text=text)

    def note(self, text: str) -> None:
        self._say("note", text=text)

    def finish(self, text: str) -> None:
        self._say("finish", text=text)

    def _say(self, event: str, **more: Any) -> None:
        content = {"event": event, "title": self._title, "seconds": round(time.monotonic() - self._begin, 3), **more}
        print(json.dumps(content), file=sys.stderr, flush=True)

    def answer(self, text: str, status: str, warnings: Sequence[str]) -> None:
        self._say("answer", status=status, text=text, warnings=list(warnings))


class BarReporter(Reporter):
    """A live bar, and below it the state of the solution; both fit a terminal of 80 columns."""

    def start(self, title: str, goal: str, total: float) -> None:
        self._title = title
        console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("[bold]{task.description}", table_column=Column(no_wrap=True, ratio=1)),
            BarColumn(bar_width=20),
            TextColumn("{task.percentage:3.0f} %"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            expand=True,
        )
        self._task: TaskID = self._progress.add_task(title, total=total)
        self._live = Live(self._view("meshing"), console=console, refresh_per_second=4)
        with sigterm_waits():  # the thread that draws does not take it
            self._live.start()

    def _view(self, state: str) -> Group:
        return Group(self._progress, Text(f"  {state}", style="dim", no_wrap=True, overflow="ellipsis"))

    def update(self, done: float, text: str, count: int) -> None:
        self._progress.update(self._task, completed=done)
        self._live.update(self._view(text))

    def note(self, text: str) -> None:
        self._live.console.print(f"{self._title}: note: {text}", highlight=False, markup=False)

    def finish(self, text: str) -> None:
        self._live.stop()
        Console(stderr=True).print(f"{self._title}: {text}", highlight=False, markup=False)

    def answer(self, text: str, status: str, warnings: Sequence[str]) -> None:
        Console(stderr=True).print(text, highlight=False, markup=False)


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
    if style == "auto":
        style = "bar" if sys.stderr.isatty() else "lines"
    return {"bar": BarReporter, "lines": LineReporter, "json": JsonReporter}[style]()

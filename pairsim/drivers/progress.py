"""What a person sees while a computation goes on: a live bar on a terminal, lines elsewhere, JSON, or nothing."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any, Literal, get_args

from rich.console import Console, Group, RenderableType
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
COLOURS = {"finished": "green", "failed": "red", "timeout": "yellow", "running": "cyan"}
"""Colours of the cases of a sweep, by status."""


class Reporter:
    """Shows nothing; the base of the others, which show what `tell` is given.

    A computation of one case begins with `start`. A sweep has no title, and uses `tell` and `show` itself.

    Attributes:
        silent: Whether it shows nothing.
    """

    silent = True
    _title = ""
    _total = 1.0

    def tell(self, event: str, line: str, **fields: Any) -> None:
        """Show an event.

        Args:
            event: Its kind.
            line: It as a line of text.
            fields: It as data.
        """

    def show(self, view: Callable[[], RenderableType]) -> None:
        """Show the state of a sweep in place of that before, on a terminal."""

    def start(self, title: str, goal: str, total: float) -> None:
        """Begin.

        Args:
            title: Name of the case.
            goal: What is to be reached, in words.
            total: The same as a number; `update` says how much of it is done.
        """
        self._title, self._total = title, total
        self.tell("start", f"{title}: {goal}", title=title, goal=goal, total=total)

    def update(self, done: float, text: str, count: int) -> None:
        """Show an accepted step or point, the count-th one."""
        part = min(done / self._total, 1.0)
        self.tell("progress", text, **self._titled, done=done, fraction=part, count=count, text=text)

    def on_the_way(self, place: str) -> None:
        """Show where a computation is that has no step or point to show yet."""
        self.tell("way", f"on the way: {place}", **self._titled, text=place)

    def note(self, text: str) -> None:
        """Show what the user should know."""
        self.tell("note", f"{self._title}: note: {text}" if self._title else text, **self._titled, text=text)

    def finish(self, text: str) -> None:
        """End with a line."""
        self.tell("finish", f"{self._title}: {text}" if self._title else text, **self._titled, text=text)

    def answer(self, text: str, status: str, warnings: Sequence[str]) -> None:
        """Show the answer, which has the warnings in its text."""
        self.tell("answer", text, **self._titled, status=status, text=text, warnings=list(warnings))

    @property
    def _titled(self) -> dict[str, str]:
        return {"title": self._title} if self._title else {}


class LineReporter(Reporter):
    """A line an event on stderr, for logs. Steps now and then: percent, state of the solution, seconds, those left."""

    silent = False

    def tell(self, event: str, line: str, **fields: Any) -> None:
        print(line, file=sys.stderr, flush=True)

    def start(self, title: str, goal: str, total: float) -> None:
        self._begin = self._last = time.monotonic()
        self._part = 0.0
        super().start(title, goal, total)

    def on_the_way(self, place: str) -> None:
        if (now := time.monotonic()) - self._last >= LINE_EVERY:
            self._last = now
            super().on_the_way(place)

    def update(self, done: float, text: str, count: int) -> None:
        now = time.monotonic()
        if count > 1 and now - self._last < LINE_EVERY:
            return
        part, passed = min(done / self._total, 1.0), now - self._begin
        # At the pace since the last line: steps grow, and those of the start would foretell hours.
        pace = (part - self._part) / (now - self._last) if now > self._last else 0.0
        left = f", {duration((1 - part) / pace)} left" if 0.01 < part < 1 and pace > 0 else ""
        self._last, self._part = now, part
        self.tell("progress", f"  {part:4.0%}  {text}  ({duration(passed)}{left})")


class JsonReporter(Reporter):
    """A JSON object a line on stderr, for programs: its `event` is start, progress, case, note, finish or answer."""

    silent = False

    def __init__(self) -> None:
        self._begin = time.monotonic()

    def tell(self, event: str, line: str, **fields: Any) -> None:
        if event == "start":
            self._begin = time.monotonic()
        content = {"event": event, "seconds": round(time.monotonic() - self._begin, 3), **fields}
        print(json.dumps(content), file=sys.stderr, flush=True)


class BarReporter(Reporter):
    """A live bar, and below it the state of the solution; both fit a terminal of 80 columns. Of a sweep its view."""

    silent = False

    def __init__(self) -> None:
        self._console = Console(stderr=True)
        # Refreshed by hand in a sweep: a thread must not be alive when children are forked.
        self._live = Live(console=self._console, auto_refresh=False)

    def tell(self, event: str, line: str, **fields: Any) -> None:
        ended = fields.get("status") if event == "case" else None
        if event == "finish":
            self._live.stop()
        if event not in ("start", "progress") and ended != "finished":
            self._console.print(Text(line, style=COLOURS.get(ended or "", "")))

    def show(self, view: Callable[[], RenderableType]) -> None:
        if not self._live.is_started:
            self._live.start()
        self._live.update(view(), refresh=True)

    def start(self, title: str, goal: str, total: float) -> None:
        super().start(title, goal, total)
        self._progress = Progress(
            TextColumn("[bold]{task.description}", table_column=Column(no_wrap=True, ratio=1)),
            BarColumn(bar_width=20),
            TextColumn("{task.percentage:3.0f} %"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=self._console,
            expand=True,
        )
        self._task: TaskID = self._progress.add_task(title, total=total)
        self._live = Live(self._view("meshing"), console=self._console, refresh_per_second=4)
        with sigterm_waits():  # the thread that draws does not take it
            self._live.start()

    def update(self, done: float, text: str, count: int) -> None:
        self._progress.update(self._task, completed=done)
        self._live.update(self._view(text))

    def on_the_way(self, place: str) -> None:
        self._live.update(self._view(f"on the way: {place}"))

    def _view(self, state: str) -> Group:
        return Group(self._progress, Text(f"  {state}", style="dim", no_wrap=True, overflow="ellipsis"))


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


def make_reporter(style: Style, rank: int = 0) -> Reporter:
    """The reporter of a style; one that shows nothing on other processes than the first."""
    if style == "none" or rank > 0:
        return Reporter()
    if style == "auto":
        style = "bar" if sys.stderr.isatty() else "lines"
    return {"bar": BarReporter, "lines": LineReporter, "json": JsonReporter}[style]()

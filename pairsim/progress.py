"""What a person sees while a run goes on: a live bar on a terminal, a line now and then elsewhere, or nothing."""

from __future__ import annotations

import sys
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

LINE_EVERY = 5.0  # seconds between plain lines


class Reporter:
    """Shows nothing; the base of the others."""

    def start(self, title: str, t_end: float) -> None:
        """Begin a run that goes to t_end."""

    def update(self, t: float, d: float | None, dU: float | None, dt: float, newton: int, step: int) -> None:
        """Tell of an accepted step; d and dU are None when there is not just one gap."""

    def note(self, text: str) -> None:
        """Tell what the user should know."""

    def finish(self, text: str) -> None:
        """End with a line."""


class PlainReporter(Reporter):
    """A line now and then on stderr, for logs."""

    def __init__(self) -> None:
        self._last = 0.0

    def start(self, title: str, t_end: float) -> None:
        self._title, self._end, self._begin = title, t_end, time.monotonic()
        print(f"{title}: to t = {t_end:g}", file=sys.stderr, flush=True)

    def update(self, t: float, d: float | None, dU: float | None, dt: float, newton: int, step: int) -> None:
        now = time.monotonic()
        if step > 1 and now - self._last < LINE_EVERY:
            return
        self._last = now
        gap = "" if d is None or dU is None else f"  d = {d:.5f}  dU = {dU:+.4e}"
        passed = now - self._begin
        print(
            f"  t = {t:.4g}{gap}  dt = {dt:.2g}  Newton {newton}  step {step}  {passed:.0f} s",
            file=sys.stderr,
            flush=True,
        )

    def note(self, text: str) -> None:
        print(f"{self._title}: note: {text}", file=sys.stderr, flush=True)

    def finish(self, text: str) -> None:
        print(f"{self._title}: {text}", file=sys.stderr, flush=True)


class RichReporter(Reporter):
    """A live bar with t, d, dU, step size, Newton iterations and time left."""

    def start(self, title: str, t_end: float) -> None:
        self._title = title
        self._progress = Progress(
            TextColumn("[bold]{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[state]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )
        self._task: TaskID = self._progress.add_task(title, total=t_end, state="meshing")
        self._progress.start()

    def update(self, t: float, d: float | None, dU: float | None, dt: float, newton: int, step: int) -> None:
        gap = "" if d is None or dU is None else f" d {d:.4f} dU {dU:+.3e}"
        self._progress.update(self._task, completed=t, state=f"t {t:.3g}{gap} dt {dt:.1e} Newton {newton}")

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

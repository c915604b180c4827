"""What a person sees while a sweep goes on, and what `pairsim status` shows."""

from __future__ import annotations

import json
import re
import sys
import time
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from pairsim.drivers.progress import Style
from pairsim.runtime.duration import duration
from pairsim.sweeps.ledger import STATUSES, Entry, Ledger

NUMBER = re.compile(r"[-+]?\d[\d.]*(e[-+]?\d+)?")  # by which the warnings of one kind differ
COLOURS = {"finished": "green", "failed": "red", "timeout": "yellow", "running": "cyan", "pending": ""}


def time_left(cases: list[dict[str, Any]], workers: int) -> float | None:
    """Seconds until the rest is done: its guessed cost, scaled by what the finished cases took. None: unknown yet."""
    done = [(c["cost"], c["seconds"]) for c in cases if c["status"] == "finished" and c["seconds"]]
    left = sum(c["cost"] for c in cases if c["status"] in ("pending", "running"))
    if not done or not workers:
        return None
    return left * sum(seconds for _, seconds in done) / sum(cost for cost, _ in done) / workers


class SweepReporter:
    """Shows nothing; the base of the others."""

    begin = 0.0

    def start(self, ledger: Ledger, workers: int, todo: int) -> None:
        """Begin."""
        self.workers, self.begin, self.ended = workers, time.monotonic(), 0

    def case(self, entry: Entry, ledger: Ledger) -> None:
        """Tell that a case has ended."""
        self.ended += entry.status != "pending"

    def tick(self, ledger: Ledger, running: dict[int, list[str]]) -> None:
        """Look at the ledger now and then."""

    def note(self, text: str) -> None:
        """Tell what the user should know."""

    def finish(self, text: str) -> None:
        """End with a line."""

    def pace(self, ledger: Ledger) -> str:
        """Rate and time left, in words."""
        passed = time.monotonic() - self.begin
        rate = f"{60 * self.ended / passed:.3g} cases/min" if self.ended and passed > 0 else ""
        left = time_left([vars(entry) for entry in ledger.entries.values()], self.workers)
        return ", ".join(part for part in (rate, f"{duration(left)} left" if left else "") if part)


def _headline(entry: Entry) -> str:
    dU = entry.values.get("dU")
    shown = f"  dU = {dU:+.4e}" if isinstance(dU, float) else ""
    reason = f" ({entry.reason})" if entry.reason not in ("", "end") else ""
    message = f"  {entry.message}" if entry.status != "finished" else ""
    count = len(entry.warnings)
    warnings = f"  {count} warning{'s' * (count > 1)}" if count else ""
    return f"{entry.status}{reason} {entry.folder}{shown}  {entry.seconds:.1f} s{warnings}{message}"


class LineSweepReporter(SweepReporter):
    """A line a case on stderr, for logs."""

    def start(self, ledger: Ledger, workers: int, todo: int) -> None:
        super().start(ledger, workers, todo)
        self._say(f"{len(ledger.entries)} cases, {todo} to do, {workers} at once")

    def case(self, entry: Entry, ledger: Ledger) -> None:
        super().case(entry, ledger)
        ended = ledger.count("finished", "failed", "timeout")
        pace = self.pace(ledger)
        self._say(f"[{ended}/{len(ledger.entries)}] {_headline(entry)}" + (f"  ({pace})" if pace else ""))

    def note(self, text: str) -> None:
        self._say(text)

    def finish(self, text: str) -> None:
        self._say(text)

    def _say(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)


class BarSweepReporter(SweepReporter):
    """A live table of counts, rate, time left and running cases."""

    def __init__(self) -> None:
        self._console = Console(stderr=True)
        # Refreshed by hand: a thread must not be alive when children are forked.
        self._live = Live(console=self._console, auto_refresh=False)
        self._shown = 0.0

    def start(self, ledger: Ledger, workers: int, todo: int) -> None:
        super().start(ledger, workers, todo)
        self._live.start()

    def case(self, entry: Entry, ledger: Ledger) -> None:
        super().case(entry, ledger)
        if entry.status != "finished":
            self._live.console.print(Text(_headline(entry), style=COLOURS[entry.status]))

    def tick(self, ledger: Ledger, running: dict[int, list[str]]) -> None:
        if time.monotonic() - self._shown < 0.25:
            return
        self._shown = time.monotonic()
        ended = ledger.count("finished", "failed", "timeout")
        table = Table(box=None, pad_edge=False, show_header=False)
        for rank, folders in sorted(running.items()):
            table.add_row(Text(f"worker {rank}", style="dim"), Text(folders[0]))
        counts = Text("  ").join(
            Text(f"{ledger.count(status)} {status}", style=COLOURS[status])
            for status in STATUSES
            if ledger.count(status)
        )
        bar = ProgressBar(total=len(ledger.entries), completed=ended, width=40)
        self._live.update(Group(bar, counts, Text(self.pace(ledger), style="dim"), table), refresh=True)

    def note(self, text: str) -> None:
        self._live.console.print(Text(text))

    def finish(self, text: str) -> None:
        self._live.stop()
        self._console.print(text, highlight=False)


class JsonSweepReporter(SweepReporter):
    """A JSON object a line on stderr, for programs: `event` is start, case, note or finish."""

    def start(self, ledger: Ledger, workers: int, todo: int) -> None:
        super().start(ledger, workers, todo)
        self._say("start", cases=len(ledger.entries), todo=todo, workers=workers)

    def case(self, entry: Entry, ledger: Ledger) -> None:
        super().case(entry, ledger)
        left = time_left([vars(entry) for entry in ledger.entries.values()], self.workers)
        counts = {status: ledger.count(status) for status in STATUSES}
        news = {key: getattr(entry, key) for key in ("folder", "status", "reason", "message", "warnings", "values")}
        self._say("case", **news, counts=counts, seconds_left=left)

    def note(self, text: str) -> None:
        self._say("note", text=text)

    def finish(self, text: str) -> None:
        self._say("finish", text=text)

    def _say(self, event: str, **more: Any) -> None:
        content = {"event": event, "seconds": round(time.monotonic() - self.begin, 3), **more}
        print(json.dumps(content), file=sys.stderr, flush=True)


def make_sweep_reporter(style: Style, rank: int) -> SweepReporter:
    """The reporter of a style; none on other processes than the first."""
    if style == "none" or rank > 0:
        return SweepReporter()
    if style == "auto":
        style = "bar" if sys.stderr.isatty() else "lines"
    return {"bar": BarSweepReporter, "lines": LineSweepReporter, "json": JsonSweepReporter}[style]()


def summarised(cases: Sequence[Mapping[str, Any]]) -> list[str]:
    """The warnings of all cases, each once with the number of its cases, and the first of them where they are several.

    Args:
        cases: Entries of sweep.json.
    """
    folders: dict[str, list[str]] = {}
    for case in cases:
        for warning in case.get("warnings", ()):
            folders.setdefault(NUMBER.sub("...", warning), []).append(case["folder"])
    first = {NUMBER.sub("...", warning): warning for case in cases[::-1] for warning in case.get("warnings", ())}
    return [
        f"{first[kind]} ({held[0]}{f' and {len(held) - 1} more' if len(held) > 1 else ''})"
        for kind, held in folders.items()
    ]


def status_view(sweep: dict[str, Any], working: bool) -> Group:
    """What `pairsim status` shows of a merged ledger: counts, pace, and the cases that failed with their reasons."""
    counts, cases = sweep["counts"], sweep["cases"]
    parts: list[Any] = [
        Text(f"{sweep['name']}: {len(cases)} cases of pairsim {sweep['command']}", style="bold"),
        Text(", ".join(f"{counts[status]} {status}" for status in STATUSES if counts[status])),
    ]
    if working:
        sessions = [content for content in sweep["sessions"] if content["counts"]["running"]]
        workers = sum(len(content["session"]["workers"]) for content in sessions)
        ended = sum(worker["cases"] for content in sessions for worker in content["session"]["workers"].values())
        seconds = max((content["session"]["seconds"] for content in sessions), default=0.0)
        pace = [f"{60 * ended / seconds:.3g} cases/min"] if ended and seconds else []
        left = time_left(cases, workers)
        pace += [f"{duration(left)} left"] if left else []
        parts.append(Text(f"at work with {workers} at once" + "".join(f", {part}" for part in pace)))
    elif counts["pending"] + counts["running"]:
        parts.append(Text("no sweep is at work here; the same command goes on with the rest"))
    parts += [Text(f"warning: {text}") for text in summarised(cases)]
    failures = [case for case in cases if case["status"] in ("failed", "timeout")]
    if failures:
        table = Table("case", "status", "reason", "what happened", box=None, pad_edge=False)
        for case in failures:
            table.add_row(*(Text(case[key]) for key in ("folder", "status", "reason", "message")))
        parts.append(table)
    return Group(*parts)

"""What a person sees while a sweep goes on, and what `pairsim status` shows."""

from __future__ import annotations

import sys
import time
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from pairsim.sweeps.ledger import STATUSES, Entry, Ledger
from pairsim.sweeps.summary import duration

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
    return f"{entry.status}{reason} {entry.folder}{shown}  {entry.seconds:.1f} s{message}"


class PlainSweepReporter(SweepReporter):
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
        self._say(f"note: {text}")

    def finish(self, text: str) -> None:
        self._say(text)

    def _say(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)


class RichSweepReporter(SweepReporter):
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
        self._live.console.print(Text(f"note: {text}"))

    def finish(self, text: str) -> None:
        self._live.stop()
        self._console.print(text, highlight=False)


def make_sweep_reporter(quiet: bool, rank: int) -> SweepReporter:
    """The reporter that fits: none on other processes or when quiet, live only on a terminal."""
    if quiet or rank > 0:
        return SweepReporter()
    return RichSweepReporter() if sys.stderr.isatty() else PlainSweepReporter()


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
        ended = sum(told["cases"] for content in sessions for told in content["session"]["workers"].values())
        seconds = max((content["session"]["seconds"] for content in sessions), default=0.0)
        pace = [f"{60 * ended / seconds:.3g} cases/min"] if ended and seconds else []
        left = time_left(cases, workers)
        pace += [f"{duration(left)} left"] if left else []
        parts.append(Text(f"at work with {workers} at once" + "".join(f", {part}" for part in pace)))
    elif counts["pending"] + counts["running"]:
        parts.append(Text("no sweep is at work here; the same command goes on with the rest"))
    failures = [case for case in cases if case["status"] in ("failed", "timeout")]
    if failures:
        table = Table("case", "status", "reason", "what happened", box=None, pad_edge=False)
        for case in failures:
            table.add_row(*(Text(case[key]) for key in ("folder", "status", "reason", "message")))
        parts.append(table)
    return Group(*parts)

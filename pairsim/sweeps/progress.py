"""What a person sees of a sweep: before it with --dry-run, while it goes on, and with `pairsim status`."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from pairsim.drivers.progress import COLOURS, Reporter
from pairsim.runtime.duration import duration
from pairsim.sweeps.grid import Grid
from pairsim.sweeps.ledger import ENDED, FAILED, Entry, Ledger
from pairsim.sweeps.options import Shard

NUMBER = re.compile(r"[-+]?\d[\d.]*(e[-+]?\d+)?")  # by which the warnings of one kind differ
SHOW_EVERY = 0.25  # seconds


class SweepProgress:
    """Tells a reporter how a sweep goes on.

    Args:
        ledger: Its ledger.
        workers: Number of its workers.
        reporter: The reporter.
    """

    def __init__(self, ledger: Ledger, workers: int, reporter: Reporter) -> None:
        self.ledger, self.workers, self.reporter = ledger, workers, reporter
        self._begin, self._shown, self._ended = time.monotonic(), 0.0, 0

    def start(self, todo: int) -> None:
        """Begin with so many cases to do."""
        self._begin, cases = time.monotonic(), len(self.ledger.entries)
        line = f"{cases} cases, {todo} to do, {self.workers} at once"
        self.reporter.say(line)

    def case(self, entry: Entry) -> None:
        """Tell that a case has ended."""
        self._ended += entry.status != "pending"
        if self.reporter.silent:  # what follows goes through all cases
            return
        counts, pace = self.ledger.counts, self._pace()
        ended = sum(counts[status] for status in ENDED)
        self.reporter.say(f"[{ended}/{len(self.ledger.entries)}] {_headline(entry)}" + (f"  ({pace})" if pace else ""))

    def tick(self, running: Mapping[int, Sequence[str]]) -> None:
        """Show the counts, the pace, and the case that each worker computes, now and then."""
        if time.monotonic() - self._shown >= SHOW_EVERY:
            self._shown = time.monotonic()
            self.reporter.show(lambda: self._view(running))

    def _view(self, running: Mapping[int, Sequence[str]]) -> Group:
        counts, table = self.ledger.counts, Table(box=None, pad_edge=False, show_header=False)
        for rank, folders in sorted(running.items()):
            table.add_row(Text(f"worker {rank}", style="dim"), Text(folders[0]))
        bar = ProgressBar(total=sum(counts.values()), completed=sum(counts[status] for status in ENDED), width=40)
        return Group(bar, _counts(counts, "  "), Text(self._pace(), style="dim"), table)

    def finish(self, text: str) -> None:
        """End with the warnings of all cases, and a line."""
        self.reporter.show(lambda: self._view({}))
        for warning in summarised(self.ledger.rows):
            self.reporter.note(f"warning: {warning}")
        self.reporter.finish(text)

    def _pace(self) -> str:
        """Rate and time left in words."""
        left = time_left(self.ledger.rows, self.workers)
        return pace_in_words(self._ended, time.monotonic() - self._begin, left)


def time_left(cases: Sequence[Mapping[str, Any]], workers: int) -> float | None:
    """Seconds until the rest is done: its guessed cost, scaled by what the finished cases took. None: unknown yet."""
    done = [(case["cost"], case["seconds"]) for case in cases if case["status"] == "finished" and case["seconds"]]
    left = sum(case["cost"] for case in cases if case["status"] in ("pending", "running"))
    if not done or not workers:
        return None
    return left * sum(seconds for _, seconds in done) / sum(cost for cost, _ in done) / workers


def pace_in_words(ended: int, seconds: float, left: float | None) -> str:
    """Rate and time left; empty while both are unknown."""
    rate = [f"{60 * ended / seconds:.3g} cases/min"] if ended and seconds > 0 else []
    return ", ".join(rate + ([f"{duration(left)} left"] if left else []))


def _counts(counts: Mapping[str, int], between: str) -> Text:
    found = [Text(f"{count} {status}", style=COLOURS.get(status, "")) for status, count in counts.items() if count]
    return Text(between).join(found)


def _headline(entry: Entry) -> str:
    dU = entry.values.get("dU")
    shown = f"  dU = {dU:+.4e}" if isinstance(dU, float) else ""
    reason = f" ({entry.reason})" if entry.reason not in ("", "end") else ""
    message = f"  {entry.message}" if entry.status != "finished" else ""
    count = len(entry.warnings)
    warnings = f"  {count} warning{'s' * (count > 1)}" if count else ""
    return f"{entry.status}{reason} {entry.folder}{shown}  {entry.seconds:.1f} s{warnings}{message}"


def summarised(cases: Sequence[Mapping[str, Any]]) -> list[str]:
    """The warnings of all cases, each once with the number of its cases, and the first of them where they are several.

    Args:
        cases: Entries of sweep.json.
    """
    kinds: dict[str, list[tuple[str, str]]] = {}
    for case in cases:
        for warning in case.get("warnings", ()):
            kinds.setdefault(NUMBER.sub("...", warning), []).append((warning, case["folder"]))
    return [
        f"{held[0][0]} ({held[0][1]}{f' and {len(held) - 1} more' if len(held) > 1 else ''})" for held in kinds.values()
    ]


def status_view(sweep: dict[str, Any], working: bool) -> Group:
    """What `pairsim status` shows of a merged ledger: counts, pace, and the cases that failed with their reasons."""
    counts, cases = sweep["counts"], sweep["cases"]
    parts: list[Any] = [
        Text(f"{sweep['name']}: {len(cases)} cases of pairsim {sweep['command']}", style="bold"),
        _counts(counts, ", "),
    ]
    if working:
        sessions = [content["session"] for content in sweep["sessions"] if content["counts"]["running"]]
        workers = [worker for session in sessions for worker in session["workers"].values()]
        seconds = max((session["seconds"] for session in sessions), default=0.0)
        ended = sum(worker["cases"] for worker in workers)
        pace = pace_in_words(ended, seconds, time_left(cases, len(workers)))
        parts.append(Text(f"at work with {len(workers)} at once" + (f", {pace}" if pace else "")))
    elif counts["pending"] + counts["running"]:
        parts.append(Text("no sweep is at work here; the same command goes on with the rest"))
    parts += [Text(f"warning: {text}") for text in summarised(cases)]
    if failures := [case for case in cases if case["status"] in FAILED]:
        table = Table("case", "status", "reason", "what happened", box=None, pad_edge=False)
        for case in failures:
            table.add_row(*(Text(case[key]) for key in ("folder", "status", "reason", "message")))
        parts.append(table)
    return Group(*parts)


def dry_run_view(grid: Grid, part: Shard | None) -> Group:
    """The output of `--dry-run`: number of cases, and estimated unknowns and time of each."""
    total = sum(case.estimate.seconds for case in grid.cases)
    headline = f"{len(grid.cases)} cases of pairsim {grid.command.name}, about {duration(total)} on one core"
    notes = [
        f"{count} {what}"
        for count, what in ((grid.duplicates, "duplicates left out"), (grid.excluded, "excluded"))
        if count
    ]
    table = Table("folder", *grid.varying, "unknowns", "seconds", box=None, pad_edge=False)
    for case in grid.cases:
        estimate = case.estimate
        values = [f"{value:g}" if isinstance(value, float) else str(value) for value in case.parameters.values()]
        table.add_row(*map(Text, [case.folder, *values, f"~{estimate.unknowns}", f"~{estimate.seconds:.2g}"]))
    lines = [headline + (f" ({', '.join(notes)})" if notes else "")]
    lines += [f"part {part.i} of {part.n} would compute its share of them"] if part else []
    return Group(*map(Text, lines), table)

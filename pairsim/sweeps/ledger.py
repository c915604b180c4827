"""What is known of every case of a sweep: `sweep.json` and `results.csv`, always whole on disk.

Both are views. The truth about a case is its own folder: a case is finished when its run.json says so and its case.yaml
has the right hash. What only the ledger knows are the endings that a folder cannot tell of: crashes and timeouts.
"""

from __future__ import annotations

import csv
import io
import json
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from pairsim.results.folders import read_record
from pairsim.results.output import plain, write_text
from pairsim.runtime.errors import InputError
from pairsim.sweeps.commands import Value
from pairsim.sweeps.grid import Grid, SweepCase, finished_in

STATUSES = ("pending", "running", "finished", "failed", "timeout")
ENDED = ("finished", "failed", "timeout")
WRITE_EVERY = 1.0  # seconds


@dataclass
class Entry:
    """A case in the ledger.

    Attributes:
        folder, key: As in `SweepCase`.
        parameters: Values of the varying keys and of those that are always shown.
        unknowns, cost: The guess: unknowns, and seconds on one core.
        status, reason, message: How it stands.
        seconds: Wall time of its last attempt, as the sweep saw it.
        attempts: How often it was started.
        again: Whether its last attempt repeats one that failed, and has not ended.
        rank: Worker that has or had it.
        values: What its folder gives to results.csv.
        warnings: What its run.json warns of.
    """

    folder: str
    key: str
    parameters: dict[str, Any]
    unknowns: int
    cost: float
    status: str = "pending"
    reason: str = ""
    message: str = ""
    seconds: float = 0.0
    attempts: int = 0
    again: bool = False
    rank: int | None = None
    values: dict[str, Value] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Shard:
    """Part `i` of `n` of a sweep, counted from 1."""

    i: int
    n: int

    @property
    def tag(self) -> str:
        """Addition to the names of its files."""
        return f"-{self.i}-of-{self.n}"


def entry_of(case: SweepCase, shown: tuple[str, ...]) -> Entry:
    """A case that nothing is known of yet."""
    always = {key: case.checked.resolved.get(key) for key in shown}
    estimate = case.checked.estimate
    return Entry(case.folder, case.key, {**case.parameters, **always}, estimate.unknowns, estimate.seconds)


class Ledger:
    """The ledger of a sweep or of a shard of one, in the sweep's folder.

    Args:
        directory: Folder of the sweep.
        grid: The grid.
        cases: The cases that this ledger keeps: all, or those of the shard.
        shard: The shard, if it is one.
        about: What else goes into sweep.json: command line, versions.
    """

    def __init__(
        self, directory: Path, grid: Grid, cases: list[SweepCase], shard: Shard | None, about: dict[str, Any]
    ) -> None:
        self.directory, self.grid = directory, grid
        self.entries = {case.folder: entry_of(case, grid.command.parameters) for case in cases}
        tag = shard.tag if shard else ""
        self.path, self.table = directory / f"sweep{tag}.json", directory / f"results{tag}.csv"
        self.about = about
        self.session: dict[str, Any] = {}
        self._written = 0.0
        self._changed = True

    def recover(self) -> None:
        """Take over what is on disk, from the folders first and from earlier ledgers of the sweep.

        Raises:
            InputError: The folder belongs to another grid.
        """
        known: dict[str, dict[str, Any]] = {}
        for content in read_ledgers(self.directory):
            if content.get("grid") != self.grid.key:
                allowed = "holds a sweep of another grid; give another folder with -o, or the grid that belongs to it"
                raise InputError(str(self.directory), "-o", None, allowed)
            known |= {old["folder"]: old for old in content["cases"] if old["status"] != "pending" or old["attempts"]}
        command = self.grid.command
        for entry in self.entries.values():
            old, directory = known.get(entry.folder, {}), self.directory / entry.folder
            for key in ("seconds", "attempts", "rank", "again"):
                setattr(entry, key, old.get(key, getattr(entry, key)))
            told = read_record(directory)
            if finished_in(directory, command, entry.key):
                entry.status = "finished"
            elif old.get("status") in ("failed", "timeout"):
                entry.status = old["status"]
                told = old
            elif told.get("status") == "failed":  # it failed and was not noted any more
                entry.status = "timeout" if told.get("reason") == "wall_time" else "failed"
            else:
                continue
            entry.reason, entry.message = told.get("reason", ""), told.get("message", "")
            entry.values = command.values(directory)
            entry.warnings = list(read_record(directory).get("warnings", ()))
            if told is old:
                entry.values["wall_time"] = entry.seconds  # its own account stops where it did

    def count(self, *statuses: str) -> int:
        """Number of cases with one of these statuses."""
        return sum(entry.status in statuses for entry in self.entries.values())

    def change(self, folder: str, **news: Any) -> Entry:
        """Note news of a case."""
        entry = self.entries[folder]
        for name, value in news.items():
            setattr(entry, name, value)
        self._changed = True
        return entry

    def write(self, now: bool = False) -> None:
        """Put both files on disk if anything has changed, once a second at most unless `now`.

        Raises:
            OSError: They cannot be written; what was there before stays.
        """
        if not now and (not self._changed or time.monotonic() - self._written < WRITE_EVERY):
            return
        content = {
            "grid": self.grid.key,
            "name": self.grid.name,
            "command": self.grid.command.name,
            "varying": list(self.grid.varying),
            "parameters": list(dict.fromkeys((*self.grid.varying, *self.grid.command.parameters))),
            "columns": list(self.grid.columns),
            "updated": time.time(),
            "counts": {status: self.count(status) for status in STATUSES},
            **self.session,
            **self.about,
            "cases": [asdict(entry) for entry in self.entries.values()],
        }
        write_text(self.table, table_of(content))
        write_text(self.path, json.dumps(plain(content), indent=1, ensure_ascii=False) + "\n")
        self._written, self._changed = time.monotonic(), False


def table_of(content: dict[str, Any]) -> str:
    """results.csv: a row a case that has ended, in the order of the grid."""
    parameters, columns = content["parameters"], content["columns"]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["folder", "status", "reason", *parameters, *columns, "warnings"])
    for case in content["cases"]:
        if case["status"] in ENDED:
            values = [case["parameters"].get(key) for key in parameters] + [case["values"].get(key) for key in columns]
            warnings = "; ".join(case.get("warnings", ()))
            writer.writerow([case["folder"], case["status"], case["reason"], *map(cell, values), warnings])
    return text.getvalue()


def cell(value: Any) -> Any:
    """A value in a table: lists, groups and truths as JSON; numbers so that reading them gives the same double."""
    if isinstance(value, list | dict | bool):
        return json.dumps(value)
    return repr(value) if isinstance(value, float) else value


def read_ledgers(directory: Path) -> list[dict[str, Any]]:
    """Every sweep.json of a folder, oldest first.

    Raises:
        InputError: One cannot be read.
    """
    found = []
    for path in [*directory.glob("sweep.json"), *directory.glob("sweep-*-of-*.json")]:
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            content["cases"], content["updated"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(str(path), "", None, f"cannot be read ({error}); remove it to start anew") from error
        found.append(content)
    return sorted(found, key=lambda content: float(content["updated"]))


def read_sweep(directory: Path) -> dict[str, Any]:
    """One ledger made of all ledgers of a folder: of each case what was noted last.

    Raises:
        InputError: The folder is not that of a sweep.
    """
    ledgers = read_ledgers(directory)
    if not ledgers:
        raise InputError(str(directory), "", None, "is not the folder of a sweep: it has no sweep.json")
    cases: dict[str, dict[str, Any]] = {}
    for content in ledgers:
        for case in content["cases"]:
            if case["status"] != "pending" or case["folder"] not in cases:
                cases[case["folder"]] = case
    merged = {**ledgers[-1], "cases": list(cases.values())}
    whole = [content for content in ledgers if not content.get("shard")]
    if whole:  # it knows the order of the grid
        order = [case["folder"] for case in whole[-1]["cases"]]
        merged["cases"] = [cases[folder] for folder in order]
    merged["counts"] = {status: sum(c["status"] == status for c in merged["cases"]) for status in STATUSES}
    merged["sessions"] = [{**content, "cases": []} for content in ledgers]
    return merged

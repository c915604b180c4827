"""The ledger of a sweep, with the status and main results of every case: `sweep.json` and `results.csv`.

Both files are replaced atomically, and are derived from the folders of the cases: a case is finished if its run.json
says so and its case.yaml has the right hash. Only crashes and timeouts are recorded in the ledger alone.
"""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pairsim.commands.command import Value
from pairsim.results.folders import read_record
from pairsim.results.output import plain, write_text
from pairsim.results.table_files import table_text
from pairsim.runtime.errors import InputError
from pairsim.runtime.version import __version__
from pairsim.sweeps.case import SweepCase
from pairsim.sweeps.grid import Grid
from pairsim.sweeps.options import Shard

STATUSES = ("pending", "running", "finished", "failed", "timeout")
FAILED = ("failed", "timeout")
ENDED = ("finished", *FAILED)
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


def entry_of(case: SweepCase, shown: tuple[str, ...]) -> Entry:
    """The entry of a case before it is started."""
    always = {key: case.resolved.get(key) for key in shown}
    return Entry(case.folder, case.key, case.parameters | always, case.estimate.unknowns, case.estimate.seconds)


class Ledger:
    """The ledger of a sweep or of a shard of one, in the sweep's folder.

    Args:
        directory: Folder of the sweep.
        grid: The grid.
        cases: The cases of the ledger: all, or those of the shard.
        shard: The shard, None for the whole sweep.

    Attributes:
        about: Further entries of sweep.json, such as command line and versions.
    """

    def __init__(self, directory: Path, grid: Grid, cases: list[SweepCase], shard: Shard | None) -> None:
        self.directory, self.grid, self.cases = directory, grid, cases
        self.entries = {case.folder: entry_of(case, grid.command.in_sweeps.parameters) for case in cases}
        tag = shard.tag if shard else ""
        self.path, self.table = directory / f"sweep{tag}.json", directory / f"results{tag}.csv"
        self.about: dict[str, Any] = {}
        self._written = 0.0
        self._changed = True

    def recover(self) -> None:
        """Recover the status of all cases from their folders and from earlier ledgers of the sweep.

        Raises:
            InputError: The folder belongs to another grid.
        """
        ledgers = read_ledgers(self.directory)
        others = [content for content in ledgers if content.get("grid") != self.grid.key]
        if others:
            version = others[0].get("versions", {}).get("pairsim", __version__)
            same = version == __version__
            whose = "of another grid" if same else f"by pairsim {version}, which gives cases other keys or defaults"
            allowed = f"must be a folder for this grid, but has a sweep {whose}"
            raise InputError(str(self.directory), "-o", None, allowed)
        known, command = _latest(ledgers), self.grid.command
        for case in self.cases:
            entry, old, directory = self.entries[case.folder], known.get(case.folder, {}), self.directory / case.folder
            for key in ("seconds", "attempts", "rank", "again"):
                setattr(entry, key, old.get(key, getattr(entry, key)))
            record = read_record(directory)
            warnings = record.get("warnings", ())
            values: dict[str, Value] = {}
            if case.finished_in(directory, command):
                entry.status = "finished"
            elif old.get("status") in FAILED:
                entry.status, record = old["status"], old
                values = {"wall_time": entry.seconds}  # run.json ends where the case was stopped
            elif record.get("status") == "failed":  # failed after the last update of the ledger
                entry.status = "timeout" if record.get("reason") == "wall_time" else "failed"
            else:
                continue
            entry.reason, entry.message = record.get("reason", ""), record.get("message", "")
            entry.values, entry.warnings = command.values(directory) | values, list(warnings)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The entries as in sweep.json."""
        return [vars(entry) for entry in self.entries.values()]

    @property
    def counts(self) -> dict[str, int]:
        """Number of cases by status."""
        return counted([entry.status for entry in self.entries.values()])

    def count(self, *statuses: str) -> int:
        """Number of cases with one of these statuses."""
        return sum(self.counts[status] for status in statuses)

    def change(self, folder: str, **changes: Any) -> Entry:
        """Change attributes of the entry of a case; returns the entry."""
        entry = self.entries[folder]
        for name, value in changes.items():
            setattr(entry, name, value)
        self._changed = True
        return entry

    def write(self, now: bool = False) -> None:
        """Write both files if an entry has changed, at most once a second unless `now`.

        Raises:
            OSError: They cannot be written; the old files are kept.
        """
        if not now and (not self._changed or time.monotonic() - self._written < WRITE_EVERY):
            return
        grid = self.grid
        content = {
            "grid": grid.key,
            "name": grid.name,
            "command": grid.command.name,
            "varying": list(grid.varying),
            "parameters": list(dict.fromkeys((*grid.varying, *grid.command.in_sweeps.parameters))),
            "columns": list(grid.columns),
            "updated": time.time(),
            "counts": self.counts,
            **self.about,
            "cases": self.rows,
        }
        write_text(self.table, table_text(*rows_of(content)))
        write_text(self.path, json.dumps(plain(content), indent=1, ensure_ascii=False) + "\n")
        self._written, self._changed = time.monotonic(), False


def counted(statuses: Iterable[str]) -> dict[str, int]:
    """Number of cases by status, of all statuses."""
    found = Counter(statuses)
    return {status: found[status] for status in STATUSES}


def rows_of(content: Mapping[str, Any]) -> tuple[list[str], list[list[Any]]]:
    """Columns and rows of results.csv: a row for each case that has ended, in the order of the grid.

    Args:
        content: Content of sweep.json.
    """
    parameters, columns = content["parameters"], content["columns"]
    rows = []
    for case in content["cases"]:
        if case["status"] in ENDED:
            values = [case["parameters"].get(key) for key in parameters] + [case["values"].get(key) for key in columns]
            warnings = "; ".join(case.get("warnings", ()))
            rows.append([case["folder"], case["status"], case["reason"], *values, warnings])
    return ["folder", "status", "reason", *parameters, *columns, "warnings"], rows


def read_ledgers(directory: Path) -> list[dict[str, Any]]:
    """Read every sweep.json of a folder (one for each shard), the oldest first.

    Raises:
        InputError: One of them is invalid.
    """
    found = []
    for path in [*directory.glob("sweep.json"), *directory.glob("sweep-*-of-*.json")]:
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            content["cases"], content["updated"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(
                str(path), "", None, f"must be a ledger of a sweep ({error}); remove the file to create it anew"
            ) from error
        found.append(content)
    return sorted(found, key=lambda content: float(content["updated"]))


def read_sweep(directory: Path) -> dict[str, Any]:
    """Merge all ledgers of a folder; for each case, the latest entry holds.

    Raises:
        InputError: The folder is not that of a sweep.
    """
    ledgers = read_ledgers(directory)
    if not ledgers:
        raise InputError(str(directory), "", None, "must be the folder of a sweep, but has no sweep.json")
    cases = _latest(ledgers)
    whole = [content["cases"] for content in ledgers if not content.get("shard")]
    order = [case["folder"] for case in whole[-1]] if whole else list(cases)  # that of the grid
    return {
        **ledgers[-1],
        "cases": [cases[folder] for folder in order],
        "counts": counted(cases[folder]["status"] for folder in order),
        "sessions": [{**content, "cases": []} for content in ledgers],
    }


def _latest(ledgers: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """The entry of each case by its folder, from the last ledger in which it was attempted."""
    cases: dict[str, dict[str, Any]] = {}
    for case in (case for content in ledgers for case in content["cases"]):
        if case["status"] != "pending" or case.get("attempts") or case["folder"] not in cases:
            cases[case["folder"]] = case
    return cases

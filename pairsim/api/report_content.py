"""What a report of a folder says: the answer, failures, warnings, the table, pictures and where they come from."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from pairsim.api.folders import open_folder
from pairsim.api.results import Result
from pairsim.api.sweeps import SweepResult
from pairsim.results.columns import COLUMNS, STUDY_COLUMNS, SWEEP_COLUMNS, Column, column
from pairsim.results.folders import kind_of
from pairsim.results.tables import read_table
from pairsim.runtime.duration import duration
from pairsim.runtime.locks import is_locked
from pairsim.sweeps.study_file import TABLE
from pairsim.sweeps.sweep_plots import outcome, quantity_of

MOST_ROWS = 2000  # of a table: a browser still sorts them at once
ENDED_BADLY = ("failed", "timeout")


@dataclass(frozen=True)
class Cell:
    """An entry of a table: its text, and the number or text that it is sorted by."""

    text: str
    value: float | str | None


@dataclass(frozen=True)
class Content:
    """What a report says.

    Attributes:
        kind: The command of the folder.
        name: Name of the folder.
        status: As that of a result; "interrupted" also where the command was killed.
        answer: In words, a line each.
        warnings: What the user should know of the results, and the cases of a sweep that it concerns.
        failures: Case, reason and message.
        columns: Name and meaning of each column of the table.
        rows: Of the table.
        left_out: Rows of the file that the table leaves out.
        table: Name of the file of the table.
        provenance: Where the results come from, in the order in which it is shown.
        case: The input file with every default.
    """

    kind: str
    name: str
    status: str
    answer: list[str]
    warnings: list[tuple[str, list[str]]]
    failures: list[tuple[str, str, str]]
    columns: list[tuple[str, str]]
    rows: list[list[Cell]]
    left_out: int
    table: str
    provenance: dict[str, str]
    case: str

    @property
    def example(self) -> str:
        """A comparison that the filter of the table understands: of the last row's first number."""
        numbers = [i for i, cell in enumerate(self.rows[-1]) if isinstance(cell.value, float)] if self.rows else []
        return f"{self.columns[numbers[0]][0]}>={self.rows[-1][numbers[0]].text}" if numbers else "status=failed"


def content_of(directory: Path) -> Content:
    """Read a folder, finished or not.

    Raises:
        InputError: It holds no results.
    """
    kind = kind_of(directory)
    if kind == "study":
        return _of_study(directory)
    result = open_folder(directory)
    return _of_sweep(directory, result) if isinstance(result, SweepResult) else _of_case(directory, kind, result)


def _of_case(directory: Path, kind: str, result: Any) -> Content:
    assert isinstance(result, Result)
    lines = [line for line in result.answer.splitlines() if not line.startswith("Warning: ")]
    failed = result.status in ENDED_BADLY
    failures = [(directory.name, result.reason, result.message)] if failed else []
    return Content(
        kind,
        directory.resolve().name,
        _status(directory, result.status),
        lines,
        [(warning, []) for warning in result.warnings],
        failures,
        *_table(result.table),
        f"{result.command.tables[0]}.csv",
        _provenance(result.record),
        _text(directory / "case.yaml"),
    )


def _of_sweep(directory: Path, result: SweepResult) -> Content:
    cases = result.record["cases"]
    counts = {status: count for status, count in result.record["counts"].items() if count}
    ended = [case for case in cases if case["status"] not in ("pending", "running")]
    ways = Counter(outcome(case, quantity_of(ended)) for case in ended)
    answer = [
        f"{len(cases)} cases of pairsim {result.record['command']}: "
        + ", ".join(f"{count} {status}" for status, count in counts.items())
        + ".",
        *(["Outcomes: " + ", ".join(f"{way} in {count}" for way, count in ways.most_common()) + "."] if ways else []),
    ]
    warnings: dict[str, list[str]] = {}
    for case in result.cases:
        for warning in case.warnings:
            warnings.setdefault(warning, []).append(case.folder.name if case.folder else "")
    failures = [
        (case["folder"], str(case["reason"]), str(case["message"])) for case in ended if case["status"] in ENDED_BADLY
    ]
    return Content(
        "sweep",
        directory.resolve().name,
        result.status,
        answer,
        list(warnings.items()),
        failures,
        *_table(result.table),
        "results.csv",
        _provenance(result.record),
        _text(directory / "grid.yaml"),
    )


def _of_study(directory: Path) -> Content:
    table = read_table(directory / TABLE)
    rows = [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]
    settings = list(table.columns)[: list(table.columns).index("status")] if len(table) else []

    def words(row: Mapping[str, Any]) -> str:
        return ", ".join(f"{name} = {_shown(row[name])}" for name in settings if not _missing(row[name]))

    cheapest = [row for row in rows if row.get("pareto") is True and not _missing(row.get("error"))]
    answer = [f"{len(rows)} discretisations. Cheapest for their error:"]
    answer += [f"{words(row)}: error {row['error']:.2g} in {row['wall_time']:.3g} s" for row in cheapest]
    failures = [(words(row), str(row["reason"]), "") for row in rows if row["status"] in ENDED_BADLY]
    grids = sorted(directory.glob("sweep-*/sweep.json"))
    record = json.loads(grids[0].read_text(encoding="utf-8")) if grids else {}
    kinds = {str(row["status"]) for row in rows}
    status = "failed" if failures else "finished" if kinds == {"finished"} else "running"
    return Content(
        "study",
        directory.resolve().name,
        _status(directory, status),
        answer,
        [],
        failures,
        *_table(table),
        TABLE,
        _provenance(record),
        _text(directory / "sweep-1" / "grid.yaml"),
    )


def _status(directory: Path, status: str) -> str:
    """A status; what claims to run and is not locked was killed."""
    return "interrupted" if status == "running" and not is_locked(directory) else status


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return ""


def _provenance(record: Mapping[str, Any]) -> dict[str, str]:
    """Command, time, machine and versions, as far as run.json or sweep.json has them."""
    machine = record.get("machine", {})
    found = {
        "command": record.get("command_line") or (record.get("command") if "kind" in record else ""),
        "started": record.get("started"),
        "wall time": duration(float(record["wall_time"])) if "wall_time" in record else None,
        "largest memory": f"{record['peak_memory'] / 2**20:.0f} MiB" if "peak_memory" in record else None,
        "unknowns": record.get("unknowns"),
        "machine": ", ".join(str(machine[name]) for name in ("node", "system", "processor") if name in machine),
        "versions": ", ".join(f"{name} {number}" for name, number in record.get("versions", {}).items()),
    }
    phases = record.get("wall_time_by_phase", {})
    found["seconds by phase"] = ", ".join(f"{name} {seconds:.2f}" for name, seconds in phases.items())
    return {name: str(value) for name, value in found.items() if value}


def _table(table: pd.DataFrame) -> tuple[list[tuple[str, str]], list[list[Cell]], int]:
    """Columns with their meaning, rows (every so many of a long table, with the last), and how many are left out."""
    step = -(-len(table) // MOST_ROWS) or 1
    kept = table.iloc[sorted({*range(0, len(table), step), *([len(table) - 1] if len(table) else [])})]
    rows = [[_cell(value) for value in row] for row in kept.itertuples(index=False, name=None)]
    return [(str(name), _meaning(str(name))) for name in table.columns], rows, len(table) - len(rows)


def _meaning(name: str) -> str:
    """What a column holds, with its unit in plain text."""
    tables: dict[str, Column] = {entry.name: entry for entry in (*STUDY_COLUMNS, *SWEEP_COLUMNS, *COLUMNS)}
    try:
        entry = tables.get(name) or column(name.partition("@")[0])
    except KeyError:
        return ""
    unit = entry.unit.replace("\\", "").replace("{", "").replace("}", "")
    return entry.meaning + (f" [{unit}]" if unit else "")


def _missing(value: Any) -> bool:
    """Whether a cell of a table is empty."""
    return not isinstance(value, list | dict | str) and bool(pd.isna(value))


def _cell(value: Any) -> Cell:
    if _missing(value):
        return Cell("", None)
    return Cell(_shown(value), float(value) if isinstance(value, int | float) else _shown(value))


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return ", ".join(map(_shown, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)

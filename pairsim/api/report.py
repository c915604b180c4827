"""One HTML file that holds all of a folder's results: `report`."""

from __future__ import annotations

import base64
import json
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any
from urllib.parse import quote

import jinja2
import pandas as pd
from markupsafe import Markup

from pairsim.api import folders
from pairsim.api.pictures import plot
from pairsim.api.results import Result
from pairsim.api.sweeps import SweepResult
from pairsim.commands import COMMANDS
from pairsim.config.physical import BLOCK
from pairsim.config.yaml_file import read_yaml
from pairsim.plots.fields import draw_fields, frame_count
from pairsim.plots.style import Page
from pairsim.results.columns import COLUMNS, STUDY_COLUMNS, SWEEP_COLUMNS, column
from pairsim.results.folders import kind_of
from pairsim.results.output import REPORT, write_text
from pairsim.results.tables import in_units, read_table, readable
from pairsim.results.typography import html_of
from pairsim.results.units import scales_in
from pairsim.runtime.duration import duration
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import is_locked
from pairsim.runtime.version import __version__
from pairsim.sweeps.study_file import TABLE
from pairsim.sweeps.sweep_plots import outcome, quantity_of

CAPTIONS = {
    "fields": "What the particles change in the liquid, and the axial elastic stress in soft ones",
    "field-streamlines": "Streamlines in the frame of the particles",
    "sweep_series": "All cases over time",
    "sweep_curves": "All curves",
    "sweep_parameters": "Relative velocity at the end over a parameter",
    "sweep_zeros": "Zeros of the relative velocity over a parameter",
    "sweep_map": "How the cases ended",
    "study": "Error against wall time",
}
"""What is said below pictures, by the names of their files; those of commands have their own."""
WIDE, NARROW = 170.0, 85.0  # mm
FIELDS = 100.0  # mm; the same file serves wide and narrow screens
TYPES = {".svg": "image/svg+xml", ".png": "image/png"}
MOST_ROWS = 2000  # of a table: a browser still sorts them at once
ENDED_BADLY = ("failed", "timeout")
NUMBERS = ("beta", "De", "Ca_e", "d0")  # of a case, that head a report


@dataclass(frozen=True)
class Content:
    """What a report says.

    Attributes:
        status: As that of a result; "interrupted" also where the command was killed.
        answer: In words, a line each.
        table: The main table.
        file: Its file.
        record: run.json or sweep.json, for where the results come from.
        case: Name of the input file with every default.
        failures: Case, reason and message.
        warnings: What the user should know of the results, with the cases of a sweep that it concerns.
    """

    status: str
    answer: list[str]
    table: pd.DataFrame
    file: str
    record: Mapping[str, Any]
    case: str
    failures: list[tuple[str, str, str]] = field(default_factory=list)
    warnings: dict[str, list[str]] = field(default_factory=dict)


def report(folder: str | PathLike[str]) -> Path:
    """Write report.html into a folder: answer, pictures, table, failures, warnings and provenance in one file.

    The file needs no network and no other file. One that is there is replaced: it holds nothing that cannot be made
    again.

    Args:
        folder: A folder of run, curve, critical, sweep or study; it may be unfinished or that of a failure.

    Returns:
        The file.

    Raises:
        InputError: The folder holds no results of pairsim, or cannot be written to.
    """
    directory = Path(folder)
    kind = kind_of(directory)
    content = _of_study(directory) if kind == "study" else _of_result(directory, folders.open(directory))
    pictures, notes = _pictures(directory, kind)
    killed = content.status == "running" and not is_locked(directory)
    loader = jinja2.PackageLoader("pairsim.api")
    pages = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, loader=loader)
    pages.filters |= {
        "shown": _shown,
        "set": lambda text: Markup(html_of(text)),
        "number": _number,
        "meaning": _meaning,
    }
    pages.filters["link"] = lambda name: _link(directory, name)
    page = pages.get_template("report.html.j2").render(
        kind=kind,
        name=directory.resolve().name,
        status="interrupted" if killed else content.status,
        content=content,
        experiment=_experiment(directory / content.case),
        table=(shown := _rows_shown(content.table)),
        rows=(rows := list(shown.itertuples(index=False, name=None))),
        example=_example(list(shown.columns), rows[-1] if rows else ()),
        pictures=pictures,
        notes=notes,
        provenance=_provenance(content.record),
        case=_text(directory / content.case),
        version=__version__,
        written=time.strftime("%Y-%m-%d %H:%M:%S %z"),
    )
    path = directory / REPORT
    try:
        write_text(path, page)
    except OSError as error:
        raise InputError(str(path), "", None, f"cannot be written ({error.strerror or error})") from error
    return path


def _of_result(directory: Path, result: Result | SweepResult) -> Content:
    if isinstance(result, SweepResult):
        return _of_sweep(result)
    answer = [line for line in result.answer.splitlines() if not line.startswith("Warning: ")]
    failed = result.status in ENDED_BADLY
    scales = scales_in(result.record)
    return Content(
        result.status,
        answer,
        result.table if scales is None else in_units(result.table, scales),
        f"{result.command.tables[0]}.csv",
        result.record,
        "case.yaml",
        [(directory.name, result.reason, result.message)] if failed else [],
        {warning: [] for warning in result.warnings},
    )


def _of_sweep(result: SweepResult) -> Content:
    cases = result.record["cases"]
    ended = [case for case in cases if case["status"] not in ("pending", "running")]
    counts = ", ".join(f"{count} {status}" for status, count in result.record["counts"].items() if count)
    ways = Counter(outcome(case, quantity_of(ended)) for case in ended).most_common()
    outcomes = ", ".join(f"{way} in {count}" for way, count in ways)
    table, settings = result.table, {"status", "reason", *result.record["parameters"]}
    alike = [name for name in table if name in settings and len(table) > 1 and table[name].map(str).nunique() == 1]
    same = {f"{name} {_shown(table[name].iloc[0])}": name for name in alike}
    warnings: dict[str, list[str]] = {}
    for case in result.cases:
        for warning in case.warnings:
            warnings.setdefault(warning, []).append(case.folder.name if case.folder else "")
    return Content(
        result.status,
        [
            f"{len(cases)} cases of pairsim {result.record['command']}: {counts}.",
            *([f"Outcomes: {outcomes}."] if ways else []),
            *([f"The same in all: {', '.join(same)}."] if same else []),
        ],
        table.drop(columns=list(same.values())),
        "results.csv",
        result.record,
        "grid.yaml",
        [
            (case["folder"], str(case["reason"]), str(case["message"]))
            for case in ended
            if case["status"] in ENDED_BADLY
        ],
        warnings,
    )


def _of_study(directory: Path) -> Content:
    table = read_table(directory / TABLE)
    rows = table.to_dict("records")
    settings = list(table.columns)[: list(table.columns).index("status")] if len(table) else []

    def words(row: Mapping[Any, Any]) -> str:
        return ", ".join(f"{name} = {shown}" for name in settings if (shown := _shown(row[name])))

    cheapest = [row for row in rows if row.get("pareto") is True and _shown(row.get("error"))]
    answer = [f"{len(rows)} discretisations. Cheapest for their error:"]
    answer += [f"{words(row)}: error {row['error']:.2g} in {row['wall_time']:.3g} s" for row in cheapest]
    failures = [(words(row), str(row["reason"]), "") for row in rows if row["status"] in ENDED_BADLY]
    grids = sorted(directory.glob("sweep-*/sweep.json"))
    record = json.loads(grids[0].read_text(encoding="utf-8")) if grids else {}
    status = "failed" if failures else "finished" if {row["status"] for row in rows} == {"finished"} else "running"
    return Content(status, answer, table, TABLE, record, "sweep-1/grid.yaml", failures)


def _experiment(path: Path) -> dict[str, str]:
    """The quantities of a case file, or of the base of a grid, and its dimensionless numbers."""
    try:
        case = read_yaml(path)
    except InputError:
        return {}
    base = case["base"] if isinstance(case.get("base"), dict) else case
    found = {**(base.get(BLOCK) or {}), **{name: base[name] for name in NUMBERS if name in base}}
    return {name.replace("_", " ") if name not in NUMBERS else name: _shown(value) for name, value in found.items()}


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


def _rows_shown(table: pd.DataFrame) -> pd.DataFrame:
    """Every so many rows of a long table, with the last; the main columns first, errors beside their quantities."""
    step = -(-len(table) // MOST_ROWS) or 1
    kept = table.iloc[sorted({*range(0, len(table), step), *([len(table) - 1] if len(table) else [])})]
    return readable(kept, whole=True)


def _example(names: list[str], row: tuple[Any, ...]) -> str:
    """A comparison that the filter of the table understands."""
    numbers = (name for name, value in zip(names, row, strict=False) if _number(value) is not None)
    return next((f"{name}>={_shown(row[names.index(name)])}" for name in numbers), "status=failed")


def _meaning(name: str) -> str:
    """What a column holds."""
    tables = {entry.name: entry for entry in (*STUDY_COLUMNS, *SWEEP_COLUMNS, *COLUMNS)}
    try:
        return (tables.get(name) or column(name.partition("@")[0])).meaning
    except KeyError:
        return ""


def _number(value: Any) -> float | None:
    """What a cell is sorted by, if it is a number."""
    return float(value) if isinstance(value, int | float) and not pd.isna(value) else None


def _shown(value: Any) -> str:
    """The text of a cell, empty where nothing is known."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return ", ".join(map(_shown, value))
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_shown(entry)}" for key, entry in value.items())
    if not isinstance(value, str) and pd.isna(value):
        return ""
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _link(directory: Path, name: str) -> Markup:
    """A file or folder beside the report, as a link where it is there."""
    place = next((each for each in (f"{name}/{REPORT}", name) if name and (directory / each).exists()), None)
    return Markup('<a href="{}">{}</a>').format(quote(place), name) if place else Markup(html_of(name))


def _pictures(directory: Path, kind: str) -> tuple[list[dict[str, str]], list[str]]:
    """Every picture (caption, data URI, the same for a narrow screen where it differs), and why some are missing."""
    command = COMMANDS.get(kind)

    def lines(width: float, out: Path) -> list[Path]:
        page = Page(("svg",), width)
        return command.draw(directory, out, page) if command else plot(directory, out=out, formats="svg", width=width)

    def fields(name: str | None, out: Path) -> list[Path]:
        """Fields are pixels anyway, and the same file serves wide and narrow screens."""
        curve = command is not None and command.frames == "d"
        return draw_fields(directory, out, Page(("png",), FIELDS, dpi=225.0), curve=curve, field=name)

    framed = command is not None and command.frames and frame_count(directory)
    wide, notes = _drawn([partial(lines, WIDE), *(partial(fields, name) for name in (None, "streamlines") if framed)])
    narrow, _ = _drawn([partial(lines, NARROW)])
    captions = CAPTIONS | (dict(command.captions) if command else {})
    found = [{"caption": captions.get(name, name), "data": wide[name], "narrow": narrow.get(name, "")} for name in wide]
    return found, notes


def _drawn(drawings: list[Callable[[Path], list[Path]]]) -> tuple[dict[str, str], list[str]]:
    """Data URIs by the names of the pictures, and why some are missing."""
    found: dict[str, str] = {}
    notes = []
    for draw in drawings:
        with tempfile.TemporaryDirectory() as name:
            try:
                files = draw(Path(name))
            except InputError as error:
                notes.append(f"No picture: {error.key or Path(error.file).name}: {error.allowed}.")
                continue
            for file in files:
                data = base64.b64encode(file.read_bytes()).decode("ascii")
                found[file.stem] = f"data:{TYPES[file.suffix]};base64,{data}"
    return found, notes

"""One HTML page that holds all of a folder's results: `report`."""

from __future__ import annotations

import base64
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import jinja2
import pandas as pd
from markupsafe import Markup

from pairsim.app import open_and_plot
from pairsim.app.sweep_results import SweepResult
from pairsim.computing.result import WARNING, Result
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import REPORT, kind_of, write_file
from pairsim.record.record import Record
from pairsim.record.run_entries import PEAK_MEMORY, SECONDS, SIZE
from pairsim.record.tables import DIGITS, brief, readable
from pairsim.runtime.errors import InputError
from pairsim.runtime.text import duration
from pairsim.runtime.version import __version__

CAPTIONS = {
    "fields": "What the particles change in the liquid, and the axial elastic stress in soft ones",
    "sweep_series": "All cases over time",
    "sweep_curves": "All curves",
    "sweep_parameters": "Relative velocity at the end over a parameter",
    "sweep_zeros": "Zeros of the relative velocity over a parameter",
}
"""Captions of pictures, by the names of their files; pictures of questions have captions of their own."""
OF_A_CASE = (SECONDS.name, PEAK_MEMORY.name, SIZE.name)
"""Entries of run.json that are those of a single case, and say nothing of a sweep."""
MOST_ROWS = 500  # of a table


def report(folder: str | PathLike[str]) -> Path:
    """Write report.html into a folder: answer, warnings, pictures, table and provenance on one page.

    The file needs no network and no other file. An existing one is replaced: it holds nothing that cannot be made
    again.

    Args:
        folder: A folder of any question, such as run or curve, or of a sweep; these may be unfinished or have failed.

    Returns:
        The file.

    Raises:
        InputError: The folder holds no results of pairsim, or cannot be written to.
    """
    directory = Path(folder)
    kind = kind_of(directory)
    content = _of_result(open_and_plot.open(directory))
    step = -(-len(content.table) // MOST_ROWS) or 1
    table = brief(content.table[::-step][::-1])
    loader = jinja2.PackageLoader("pairsim.app")
    pages = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, loader=loader)
    case = next((path for name in ("case.yaml", "grid.yaml") if (path := directory / name).is_file()), None)
    page = pages.get_template("report.html.j2").render(
        status=content.status,
        answer=content.answer,
        warnings=content.warnings,
        physical=content.record.scales is not None,
        file=content.file,
        provenance=_provenance(content.record),
        kind=kind,
        name=directory.resolve().name,
        pictures=_pictures(directory, kind),
        table=Markup(table.to_html(index=False, border=0, na_rep="", float_format=DIGITS)) if len(table) else "",
        step=step,
        case=case.read_text(encoding="utf-8") if case else "",
        version=__version__,
        written=time.strftime("%Y-%m-%d %H:%M:%S %z"),
    )
    path = directory / REPORT
    write_file(path, page)
    return path


@dataclass(frozen=True)
class Content:
    """The content of the page on a result, with the name of the file from which its table is."""

    status: str
    answer: Sequence[str]
    warnings: Sequence[str]
    table: pd.DataFrame
    file: str
    record: Record


def _of_result(result: Result | SweepResult) -> Content:
    """The content of the page on a result."""
    if isinstance(result, SweepResult):
        first, file = result.cases[0].record if result.cases else Record(), "results.csv"
        record = Record({name: value for name, value in first.items() if name not in OF_A_CASE})
        table = result.frame("results", physical=None)
        answer = [", ".join(f"{count} {status}" for status, count in result.record.counts.items() if count)]
        failed = ((case.folder, case.state) for case in result.record.without_result)
        warnings = [f"{folder}: {state.message or state.reason}" for folder, state in failed] + result.warnings
    else:
        record, file = result.record, f"{result.question.table}.csv"
        answer = [line for line in result.answer.splitlines() if not line.startswith(WARNING)]
        warnings = result.warnings
        table = readable(result.frame(physical=None) if len(result.table) else result.table, whole=True)
    return Content(result.status, answer, warnings, table, file, record)


def _provenance(record: Record) -> dict[str, str]:
    """Command, time, machine and versions, as far as run.json has them."""
    found = {
        "command": record.command,
        "started": record.started,
        "wall time": duration(record.wall_time) if record.wall_time is not None else None,
        "peak memory": f"{record.peak_memory / 2**20:.0f} MiB" if record.peak_memory is not None else None,
        "unknowns": record.unknowns,
        "machine": ", ".join(record.machine.values()),
        "versions": ", ".join(f"{name} {number}" for name, number in record.versions.items()),
    }
    return {name: str(value) for name, value in found.items() if value}


def _pictures(directory: Path, kind: str) -> list[tuple[str, str]]:
    """The pictures that `pairsim plot` draws, as captions and data URIs; none if there is nothing to draw yet."""
    captions = CAPTIONS | dict(QUESTIONS[kind].captions if kind in QUESTIONS else {})
    with tempfile.TemporaryDirectory() as out:
        try:
            files = open_and_plot.plot(directory, out=out)
        except InputError:
            return []
        encoded = ((path.stem, base64.b64encode(path.read_bytes()).decode("ascii")) for path in files)
        return [(captions.get(name, name), f"data:image/png;base64,{data}") for name, data in encoded]

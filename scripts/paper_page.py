"""Tables and pictures of docs/paper.md, from the results of `scripts/paper`."""

from __future__ import annotations

import datetime
import math
import textwrap
from collections.abc import Sequence
from pathlib import Path

from markdown_tables import put, table
from measuring import machine
from paper_pictures import canvas_of
from paper_results import Critical, Curve, Figure, Marker, NotComputed, Results, Transient, computations, figures
from paper_statements import CHECKS, Row, judged

from pairsim.plots.style import Page
from pairsim.results.output import write_text

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "paper.md"
IMAGES = ROOT / "docs" / "images" / "paper"
WIDTH, DPI = 170.0, 130.0
"""Width [mm] and pixels by inch of the pictures on the page."""
VERDICTS = ("holds", "within error", "does not hold", "not computed")


def cell(text: str) -> str:
    """Text of a cell of a table."""
    return text.replace("|", "\\|")


def statement_table(rows: Sequence[Row]) -> str:
    """Statements with figures, verdict and command; where one does not hold, also by other discretisations."""
    lines = []
    for row in rows:
        parts = [row.figures]
        if row.verdict != "holds":
            parts += [f"{CHECKS[name]}: {verdict} ({text})" for name, (verdict, text) in row.others.items()]
        verdict = f"**{row.verdict}**" if row.verdict == "does not hold" else row.verdict
        text = "<br>".join(map(cell, parts))
        lines.append([cell(row.statement.text), text, verdict, f"`scripts/paper {row.statement.figure}`"])
    return table(["the paper says", "our figures", "", "command"], lines)


def counts(rows: Sequence[Row]) -> str:
    """How many statements have each verdict."""
    found = {verdict: sum(row.verdict == verdict for row in rows) for verdict in VERDICTS}
    return f"{len(rows)} statements: " + ", ".join(f"{n} {verdict}" for verdict, n in found.items() if n) + ".\n"


def effort_row(name: str, results: Results) -> list[str]:
    """Row of the table of figures: cases, seconds, points or steps, and errors."""
    finished = failed = total = points = 0
    seconds, intervals, ends = 0.0, [math.nan], [math.nan]
    for each in computations(name):
        record = results.record(each)
        if record is None:
            continue
        total += len(record["cases"])
        failed += sum(case["status"] in ("failed", "timeout") for case in record["cases"])
        for case in results.cases(each):
            finished += 1
            seconds += case.seconds
            if isinstance(case, Curve):
                points += len(case.d)
                intervals.append(case.largest_interval)
                ends.append(float(case.table["ends_error"].max()) / case.peak)
            elif isinstance(case, Transient):
                points += len(case.table["t"])
            elif isinstance(case, Critical):
                points += len(case.rows)
    used = sorted({str(case.parameters["accuracy"]) for each in computations(name) for case in results.cases(each)})
    errors = [f"{100 * value:.2g}" if value == value else "" for value in (largest(intervals), largest(ends))]
    done = f"{finished} of {total}" + (f", {failed} failed" if failed else "") if total else "none"
    shown = title(name) if name in CHECKS else f"[{title(name)}](#{name})"
    return [shown, done, ", ".join(used), f"{seconds:.0f}", str(points or ""), *errors]


def largest(values: Sequence[float]) -> float:
    """The largest number, NaN if there is none."""
    return max((value for value in values if value == value), default=math.nan)


def title(name: str) -> str:
    """Fig. 7 of fig07; what a folder of checks is for."""
    return CHECKS[name] if name in CHECKS else f"Fig. {int(name.removeprefix('fig'))}"


def effort(results: Results) -> str:
    """Table of all figures."""
    head = [
        "figure",
        "own cases finished",
        "accuracy",
        "s of one core",
        "points or steps",
        "largest dU_error, % of the peak",
    ]
    head += ["ends_error, % of the peak"]
    names = [name for name, figure in figures().items() if computations(name) and not figure.of_meshes]
    return table(head, [effort_row(name, results) for name in (*names, *CHECKS)])


def unfinished(name: str, results: Results) -> bool:
    """Whether cases of a computation are to do; a mesh has none."""
    if (results.output / f"{name}.vtu").is_file():
        return False
    record = results.record(name)
    return record is None or record["counts"]["finished"] + record["counts"]["failed"] < len(record["cases"])


def save_for_page(name: str, figure: Figure, results: Results) -> None:
    """Draw a figure for the page, on which fewer pixels will do.

    Raises:
        NotComputed: It has nothing to show.
    """
    page = Page(("png",), WIDTH, DPI)
    page.save(canvas_of(figure, results, page), IMAGES, name)


def section(name: str, figure: Figure, rows: Sequence[Row], results: Results) -> str:
    """Heading, picture and statements of a figure."""
    lines = [f"### {title(name)} {{#{name}}}", "", textwrap.fill(f"*{figure.caption}.*", 100), ""]
    left = [each for each in figure.needs if unfinished(each, results)]
    if left:
        lines += [textwrap.fill(f"Not complete: cases of {', '.join(left)} are still to be computed.", 100), ""]
    try:
        save_for_page(name, figure, results)
        lines += [f"![{title(name)}](images/paper/{name}.png)", ""]
    except NotComputed:
        (IMAGES / f"{name}.png").unlink(missing_ok=True)
    own = [row for row in rows if row.statement.figure == name]
    return "\n".join([*lines, statement_table(own)]) if own else "\n".join(lines)


def marker_row(marker: Marker) -> list[str]:
    """A transient beside its curve."""
    case = marker.run.parameters
    dU, curve = marker.run.last("dU"), float(marker.curve.at("dU", marker.d))
    beta = case["beta"][0] if isinstance(case["beta"], list) else case["beta"]
    Ca_e = case["Ca_e"][0] if isinstance(case["Ca_e"], list) else case["Ca_e"]
    row = [f"{v:g}" for v in (beta, case["De"], Ca_e, case["d0"][0] if isinstance(case["d0"], list) else case["d0"])]
    row += [f"{marker.run.last('t'):g}", f"{marker.d:.4f}", f"{dU:.4e}", f"{curve:.4e}"]
    return [*row, f"{100 * marker.rest / marker.curve.peak:.2f}", f"{marker.rest / marker.interval:.1f}"]


def markers(results: Results) -> str:
    """Table of all transients beside their curves."""
    try:
        found = results.markers()
    except NotComputed:
        return "None is computed yet.\n"
    head = ["beta", "De", "Ca_e", "d_0", "t", "d", "dU of the transient", "dU of the curve"]
    head += ["difference, % of the peak", "difference in intervals"]
    return table(head, [marker_row(marker) for marker in found])


def made(results: Results, quick: bool) -> str:
    """When and on what the results were computed."""
    times = [record["updated"] for name in results.names if (record := results.record(name)) is not None]
    days = [str(datetime.date.fromtimestamp(each)) for each in (min(times), max(times))] if times else ["never"]
    how = "with `--quick`, whose coarse meshes prove nothing" if quick else "beside other work"
    left = [each for name in (*figures(), *CHECKS) for each in computations(name) if unfinished(each, results)]
    text = f"Computed {' to '.join(dict.fromkeys(days))} on {machine()}, one thread a process, {how}."
    if left:
        text += f" Still to be computed, in whole or in part: {', '.join(left)}."
    return textwrap.fill(text, 100) + "\n"


def write_page(results: Results, quick: bool) -> None:
    """Insert tables and pictures into the page.

    Args:
        results: The results.
        quick: Whether they were computed with `--quick`.
    """
    rows = judged(results)
    no = [row for row in rows if row.verdict in ("does not hold", "within error")]
    page = PAGE.read_text()
    parts = [section(name, figure, rows, results) for name, figure in figures().items()]
    for name, content in {
        "made": made(results, quick),
        "counts": counts(rows),
        "differences": statement_table(no) if no else "None.\n",
        "effort": effort(results),
        "figures": "\n".join(parts),
        "markers": markers(results),
    }.items():
        page = put(page, name, content)
    write_text(PAGE, page)

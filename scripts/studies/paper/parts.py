"""A part for each figure of the paper, and for each way in which its statements are judged again.

A part computes the cases that its figure shows, draws it, and judges what the paper says of it. Cases that several
figures show are computed once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

from book.apart import apart
from book.cases import Case, Cases, NotComputed
from book.kept import Kept
from book.meshes import write_mesh
from book.study import Part, Row
from book.uses import in_time, solvers, steady

from pairsim.plots.style import Page
from studies.paper import figures
from studies.paper.figures import CHECKS, FIGURES, computations, identity, judged_by, needed
from studies.paper.pictures import WIDTHS, draw
from studies.paper.words import judged, transients

LAWS = ("newtonian", "giesekus", "neo_hookean")
SOLVERS = (*steady(*LAWS), *in_time(*LAWS), *solvers("errors"))
USES = (*dict.fromkeys(SOLVERS), "pairsim.analysis.master_curve", "scripts.studies.paper.words")
QUICK = ("fig02", "fig04", "fig11")
"""Figures of the quick form."""
KEPT = Kept(USES, 2400.0)
NOT_COMPUTED = "not computed"
DRAWING = Lock()  # matplotlib has one state for all threads


def parts(quick: bool) -> list[Part]:
    """All parts, or those of some figures on coarse cells, which prove nothing."""
    names = QUICK if quick else (*FIGURES, *CHECKS)
    return [Part(name, identity(name, quick), partial(_rows, name, quick)) for name in names]


def _rows(name: str, quick: bool, folder: Path) -> list[Row]:
    """Rows of the kinds effort, marker and statement; the picture is left in the folder in which files are."""
    results = {each: _results(each, quick, folder) for each in needed(name)}
    cases = Cases(results)
    if name in FIGURES:
        _draw(name, cases, folder)
    rows: list[Any] = [_effort([each for own in computations(name) for each in results[own]])]
    if name in FIGURES:
        with suppress(NotComputed):
            others = [each for each in needed(name) if each.endswith("/markers") and each not in computations(name)]
            own = Cases({each: found for each, found in results.items() if each not in others})
            rows += [{"kind": "marker", **row} for row in transients(own).to_dict("records")]
    rows += _statements(name, cases)
    return [{**row, "coarse": quick} for row in rows]


def _results(computation: str, quick: bool, folder: Path) -> list[Any]:
    """The results of a computation."""
    if figures.is_mesh(computation):
        apart(write_mesh, figures.CASES / f"{computation}.yaml", folder / f"{computation}.vtu")
        return []
    found = figures.grid(computation, quick)
    return [KEPT.result(found.question.name, each.case, folder) for each in figures.chosen(found, quick)]


def _draw(name: str, cases: Cases, folder: Path) -> None:
    """Draw the picture of the page, and those of one and two columns of a journal, unless its cases have failed."""
    pages = {"": Page(("png",), 170.0, 130.0)}
    pages |= {f"-{width}mm": Page(("png", "pdf"), width) for width in WIDTHS}
    with DRAWING, suppress(NotComputed):
        for end, page in pages.items():
            draw(FIGURES[name].panels, cases, page, folder, name + end)


def _effort(results: Sequence[Any]) -> Row:
    """How many of the cases of a folder have finished, how long they took and how well their dU is known."""
    ended = [Case(each) for each in results if each.status == "finished"]
    errors = [case.table["dU_error"].max() / case.peak for case in ended if case.kind == "curve"]
    seconds = sum(float(case.result.record.wall_time or 0) for case in ended)
    return {
        "kind": "effort",
        "finished": len(ended),
        "cases": len(results),
        "seconds": seconds,
        "largest_error": max(errors, default=None),
    }


def _statements(name: str, cases: Cases) -> Iterator[Row]:
    """What is found of the statements of a figure, or by a check of all those that it can judge."""
    how = name if name in CHECKS else ""
    for each in judged_by(name):
        row: Row = {"kind": "statement", "figure": each.figure, "says": each.says, "by": how or None}
        try:
            found = judged(each.by(how), cases)
        except NotComputed as lacking:
            if not how:
                yield {**row, "verdict": NOT_COMPUTED, "numbers": str(lacking)}
            continue
        margin, error = found.decisive
        yield {**row, "verdict": found.verdict, "margin": margin, "error": error, "numbers": found.numbers}

"""The study of the paper: its figures have what they show, and its statements are judged by results."""

from __future__ import annotations

import sys
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from support.inputs import ROOT

from pairsim.computing.case_files import read_case
from pairsim.questions.registry import QUESTIONS

sys.path.append(str(ROOT / "scripts"))

from book.cases import Cases, NotComputed
from book.results import Results
from book.statements import Judged
from studies.paper import STUDY, judgement
from studies.paper.figures import CASES, CHECKS, FIGURES, STATEMENTS, computations, grid, is_mesh, judged_by, needed
from studies.paper.words import CriticalDistances, judged, slope

NAMES = [*FIGURES, *CHECKS]
GRIDS = [each for name in NAMES for each in computations(name) if not is_mesh(each)]


@pytest.mark.parametrize("name", GRIDS)
def test_computations_are_grids(name: str) -> None:
    assert grid(name, False).cases
    quick = grid(name, True)  # a CI machine computes each in a minute at most
    assert max(quick.question.estimate(each.case).seconds for each in quick.cases) < 60


def test_all_figures_have_what_they_show() -> None:
    assert list(FIGURES) == [f"fig{number:02d}" for number in range(2, 18) if number != 5]
    assert all((CASES / f"{each}.yaml").is_file() for name in NAMES for each in needed(name))
    for name in computations("fig02"):
        assert read_case(QUESTIONS["run"], CASES / f"{name}.yaml").mesh.Np >= 20


def test_each_curve_has_a_transient_and_six_have_three() -> None:
    def parameters(names: list[str]) -> Counter[tuple[float, ...]]:
        found = [case.case.resolved() for name in names for case in grid(name, False).cases]
        return Counter(tuple(np.ravel(case[key])[0] for key in ("beta", "De", "Ca_e")) for case in found)

    curves = parameters([name for name in GRIDS if name.endswith("/curves") and "14" not in name])
    markers = parameters([name for name in GRIDS if name.endswith("/markers")])
    assert set(curves) == set(markers)
    assert sum(count == 3 for count in markers.values()) >= 6


def test_statements_without_results_are_not_computed() -> None:
    """Which shows that their expressions are valid, as far as their first result."""
    for each in STATEMENTS:
        for how in ("", *CHECKS):
            if expression := each.by(how):
                with pytest.raises(NotComputed):
                    judged(expression, Cases({}))


def test_every_statement_is_judged_by_the_stored_rows() -> None:
    rows = Results(STUDY.stored).of(STUDY.parts(False))
    assert set(judgement.verdicts(rows)["verdict"]) == {"holds", "does not hold", "within error"}
    for name in CHECKS:
        known = {(each.figure, each.says) for each in judged_by(name)}
        own = rows[(rows["part"] == name) & (rows["kind"] == "statement")]
        assert set(zip(own["figure"], own["says"], strict=True)) <= known


def statement(verdict: str, **more: Any) -> pd.DataFrame:
    """Rows in which the first statement of Fig. 3 has a verdict, and the second holds."""
    first, second = (each for each in STATEMENTS if each.figure == "fig03")
    row = {"part": "fig03", "kind": "statement", "figure": "fig03", "by": None, "numbers": "1", "coarse": False, **more}
    effort = {"part": "fig03", "kind": "effort", "finished": 5, "cases": 5}
    found = [{**row, "says": first.says, "verdict": verdict}, {**row, "says": second.says, "verdict": "holds"}, effort]
    return pd.DataFrame(found)


def test_a_verdict_that_the_page_does_not_discuss_is_found() -> None:
    stated = "Fig. 3: what the paper says holds, but for what docs/paper.md discusses"
    parts = [part for part in STUDY.parts(False) if part.name == "fig03"]
    assert judgement.statements(statement("holds"), parts)[stated].verdict == "holds"
    found = judgement.statements(statement("does not hold"), parts)[stated]
    assert found.verdict == "does not hold"
    assert STATEMENTS[0].says in found.numbers


def test_coarse_cells_decide_nothing() -> None:
    found = judgement.statements(statement("does not hold", coarse=True), STUDY.parts(True))
    assert found["Fig. 3: its statements can be judged"].verdict == "holds"


def test_a_critical_distance_that_coarse_cases_lack_is_not_computed() -> None:
    """`scripts/study paper --quick` has other Ca_e than the paper."""
    found = CriticalDistances({0.01: (0.25, 0.001)})
    for lacking in (lambda: found[0.005], lambda: slope(found)):
        with pytest.raises(NotComputed):
            lacking()


@pytest.mark.parametrize("margins", [[(1.0, 0.1), (0.2, 0.3)], [(0.05, 0.1), (-0.2, 0.1), (-0.1, 0.3)], [(1.0, 0.1)]])
def test_the_decisive_margin_alone_has_the_verdict_of_all(margins: list[tuple[float, float]]) -> None:
    whole = Judged(tuple(margins))
    assert Judged((whole.decisive,)).verdict == whole.verdict


@cache
def part(name: str) -> Any:
    return next(each for each in STUDY.parts(True) if each.name == name)


@pytest.mark.slow
def test_a_figure_leaves_its_pictures_in_the_folder_of_its_part(tmp_path: Path) -> None:
    """Fig. 4: two short runs of a single particle."""
    (tmp_path / "fig04").mkdir()
    (row,) = part("fig04").compute(tmp_path / "fig04")
    assert (row["finished"], row["cases"], row["coarse"]) == (2, 2, True)
    ends = ("", "-85mm", "-170mm")
    drawn = {f"fig04{end}.png" for end in ends} | {f"fig04{end}.pdf" for end in ends[1:]}
    assert {path.name for path in (tmp_path / "fig04").iterdir()} == drawn

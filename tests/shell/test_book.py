"""The pages of scripts/paper, scripts/validation and scripts/accuracy: made of the results, judged by margins."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
from support.inputs import ROOT

from pairsim.computing.case_files import read_case
from pairsim.questions.registry import QUESTIONS
from pairsim.sweeps.grid import Grid, grid_from, read_grid

sys.path.append(str(ROOT / "scripts"))  # the modules of a script lie beside it

import accuracy
import paper
import pictures
import validation
from book import cases, pages
from book.statements import Judged
from book.study import names, study_of
from paper_statements import CriticalDistances, deviations, judged, slope

GRIDS = [name for name in paper.computations(paper.FIGURES) if not name.startswith("fig02/")]
CHECKED = paper.computations(paper.CHECKS)


@cache
def grid(name: str, *, quick: bool) -> Grid:
    _, path, *settings = paper.words(name, quick)
    return read_grid(Path(path), tuple(settings[1::2]))


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", GRIDS + CHECKED)
def test_computations_are_grids(name: str, quick: bool) -> None:
    checked = grid(name, quick=quick)
    assert checked.cases
    if quick:  # a CI machine computes each in a minute at most
        assert max(checked.question.estimate(each.case).seconds for each in checked.cases) < 60


def test_all_figures_have_what_they_show() -> None:
    assert list(paper.FIGURES) == [f"fig{number:02d}" for number in range(2, 18) if number != 5]
    assert all((paper.FOLDER / f"{name}.yaml").is_file() for name in paper.needed(paper.KNOWN))
    for name in paper.computations(["fig02"]):
        assert read_case(QUESTIONS["run"], paper.FOLDER / f"{name}.yaml").mesh.Np >= 20


def test_each_curve_has_a_transient_and_six_have_three() -> None:
    def parameters(names: list[str]) -> Counter[tuple[float, ...]]:
        found = [case.case.resolved() for name in names for case in grid(name, quick=False).cases]
        return Counter(tuple(np.ravel(case[key])[0] for key in ("beta", "De", "Ca_e")) for case in found)

    curves = parameters([name for name in GRIDS if name.endswith("/curves") and "14" not in name])
    markers = parameters([name for name in GRIDS if name.endswith("/markers")])
    assert set(curves) == set(markers)
    assert sum(count == 3 for count in markers.values()) >= 6


def test_every_picture_of_the_documents_has_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "state", lambda paths: " ".join(paths))
    commands = {name: command for name, command, _ in pictures.pictures()}
    drawn = {str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.png")}
    assert drawn <= commands.keys()
    assert commands["docs/images/paper/fig02.png"] == "scripts/paper fig02 --page"


def test_statements_without_results_are_not_computed(tmp_path: Path) -> None:
    """Which shows that their expressions are valid, as far as their first result."""
    nothing = cases.Cases(tmp_path, paper.computations(paper.KNOWN))
    for _, statement in paper.STATEMENTS:
        assert statement.keys() <= {"says", "check", "again", "in_time"}
        for key in statement.keys() - {"says"}:
            assert judged(statement[key], nothing)[0] == "not computed", statement["says"]


@pytest.mark.long
def test_two_small_figures_from_end_to_end(tmp_path: Path) -> None:
    """Figs. 2 and 4: meshes, two runs with a single particle, pictures in two widths."""
    script = [sys.executable, str(ROOT / "scripts" / "paper.py"), "fig02", "fig04", "--quick", "-o", str(tmp_path)]
    done = subprocess.run([*script, "--workers", "2"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in (tmp_path / "fig02").iterdir()) == ["default.vtu", "paper.vtu"]
    pictures = {path.name for path in (tmp_path / "pictures").iterdir()}
    ends = ("85mm.pdf", "85mm.png", "170mm.pdf", "170mm.png")
    assert pictures == {f"{name}-{end}" for name in ("fig02", "fig04") for end in ends}
    (off,) = {len(deviations(case.frame(0.1))) for case in cases.Cases(tmp_path, []).of("fig04/runs")}
    assert off == 1
    assert "| the paper says |" in (tmp_path / "statements.md").read_text()


BOOK, CONFIGS = ROOT / "docs" / "validation", ROOT / "configs" / "validation"


@pytest.fixture(scope="module")
def values() -> pd.DataFrame:
    """All values with references."""
    return pd.concat([validation.judged(validation.stored(name)) for name in validation.PAGES])


def test_no_number_of_a_page_was_typed() -> None:
    made = validation.pages()
    of_studies = {study_of(name).page for name in names()}
    assert set(made) == {path.name for path in BOOK.glob("*.md") if path not in of_studies}
    for name, text in made.items():
        assert (BOOK / name).read_text() == text, "written by scripts/validation all --pages"


def test_every_table_is_stored_and_has_its_place() -> None:
    for name, page in validation.PAGES.items():
        assert pages.marks((BOOK / f"{name}.md").read_text()) == set(page["tables"]) == set(validation.stored(name))


@pytest.mark.parametrize("script", [paper, accuracy], ids=lambda script: script.__name__)
def test_page_is_that_of_the_stored_results(script: ModuleType) -> None:
    text = script.PAGE.read_text()
    assert pages.marks(text) == set(script.blocks())
    assert pages.filled(text, script.blocks()) == text, "written by the script with --page"


def test_every_statement_of_the_paper_has_its_row() -> None:
    stored = pages.stored("paper")["statements"]
    known = [(figure, each["says"]) for figure, each in paper.STATEMENTS]
    assert list(zip(stored["figure"], stored["the paper says"], strict=True)) == known


def test_a_critical_distance_that_coarse_cases_lack_is_not_computed() -> None:
    """`scripts/paper --quick` has other Ca_e than the paper."""
    found = CriticalDistances({0.01: (0.25, 0.001)})
    for lacking in (lambda: found[0.005], lambda: slope(found)):
        with pytest.raises(cases.NotComputed):
            lacking()


def test_differences_are_as_small_as_allowed(values: pd.DataFrame) -> None:
    assert len(values) > 120
    assert values["good"].all()


def test_every_reference_has_a_source_and_is_used(values: pd.DataFrame) -> None:
    groups, sources = (validation.REFERENCES[name] for name in ("groups", "sources"))
    hows = [
        how
        for page in validation.PAGES.values()
        for table in page["tables"].values()
        for how in (table, *table.get("compare", {}).values())
    ]
    assert {group["source"] for group in groups.values()} | {how["source"] for how in hows if "source" in how} == set(
        sources
    )
    assert {float(value) for group in groups.values() for value in group["values"].values()} <= set(values["reference"])


def test_cases_of_the_book_are_valid() -> None:
    for page in validation.PAGES.values():
        for sweep in page.get("sweeps", {}).values():
            grid = {key: value for key, value in sweep.items() if key not in ("quick", "may_fail")}
            for each in (grid, grid | sweep.get("quick", {})):
                assert grid_from(CONFIGS / "book.yaml", each).cases


def test_values_that_are_too_far_off_are_found() -> None:
    table = pd.DataFrame(
        {"value": [1.01, 1.01, 0.1, 5.0], "reference": [1, 1, 0, None], "allowed": [0.02, 0.005, 0.2, 0.1]}
    )
    assert validation.judged({"one": table})["good"].tolist() == [True, False, True]


@pytest.mark.parametrize(
    ("margins", "verdict"),
    [
        ([(1.0, 0.1), (0.2, 0.1)], "holds"),
        ([(1.0, 0.1), (0.05, 0.1)], "within error"),
        ([(-0.05, 0.1), (1.0, 0.1)], "within error"),
        ([(0.05, 0.1), (-0.2, 0.1)], "does not hold"),
    ],
)
def test_verdicts(margins: list[tuple[float, float]], verdict: str) -> None:
    assert Judged(tuple(margins)).verdict == verdict

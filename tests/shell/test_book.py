"""The pages of scripts/validation and pictures of the documents: made of the results, judged by margins."""

from __future__ import annotations

import sys

import pandas as pd
import pytest
from support.inputs import ROOT

from pairsim.sweeps.grid import grid_from

sys.path.append(str(ROOT / "scripts"))  # the modules of a script lie beside it

import pictures
import validation
from book import pages
from book.statements import Judged
from book.study import names, study_of


def test_every_picture_of_the_documents_has_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "state", lambda paths: " ".join(paths))
    commands = {name: command for name, command, _ in pictures.pictures()}
    drawn = {str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.png")}
    assert drawn <= commands.keys()
    assert commands["docs/images/paper/fig02.png"] == "scripts/study paper --only fig02 && scripts/study paper --page"


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

"""The validation book: pages are made of the results, references have sources, differences are as small as said."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import ModuleType

import pandas as pd
import pytest
from support.inputs import ROOT

from pairsim.sweeps.grid import grid_from

BOOK, FOLDER = ROOT / "docs" / "validation", ROOT / "configs" / "validation"


@pytest.fixture(scope="module")
def book() -> Iterator[ModuleType]:
    """The script that writes the pages."""
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        import validation

        yield validation
    finally:
        sys.path.remove(str(ROOT / "scripts"))


@pytest.fixture(scope="module")
def values(book: ModuleType) -> pd.DataFrame:
    """All values with references."""
    return pd.concat([book.judged(book.stored(name)) for name in book.PAGES])


def test_no_number_of_a_page_was_typed(book: ModuleType) -> None:
    made = book.pages()
    assert set(made) == {path.name for path in BOOK.glob("*.md")}
    for name, text in made.items():
        assert (BOOK / name).read_text() == text, "written by scripts/validation all --pages"


def test_every_table_is_stored_and_has_its_place(book: ModuleType) -> None:
    from book.pages import marks

    for name, page in book.PAGES.items():
        assert marks((BOOK / f"{name}.md").read_text()) == set(page["tables"]) == set(book.stored(name))


def test_page_of_speed_is_that_of_the_stored_results(book: ModuleType) -> None:
    import accuracy
    from book.pages import filled, marks

    page = accuracy.PAGE.read_text()
    assert marks(page) == set(accuracy.blocks())
    assert filled(page, accuracy.blocks()) == page, "written by scripts/accuracy --page"


def test_differences_are_as_small_as_allowed(values: pd.DataFrame) -> None:
    assert len(values) > 120
    assert values["good"].all()


def test_every_reference_has_a_source_and_is_used(book: ModuleType, values: pd.DataFrame) -> None:
    groups, sources = (book.REFERENCES[name] for name in ("groups", "sources"))
    hows = [
        how
        for page in book.PAGES.values()
        for table in page["tables"].values()
        for how in (table, *table.get("compare", {}).values())
    ]
    assert {group["source"] for group in groups.values()} | {how["source"] for how in hows if "source" in how} == set(
        sources
    )
    assert {float(value) for group in groups.values() for value in group["values"].values()} <= set(values["reference"])


def test_cases_of_the_book_are_valid(book: ModuleType) -> None:
    for page in book.PAGES.values():
        for sweep in page.get("sweeps", {}).values():
            grid = {key: value for key, value in sweep.items() if key not in ("quick", "may_fail")}
            for each in (grid, grid | sweep.get("quick", {})):
                assert grid_from(FOLDER / "book.yaml", each).cases


@pytest.mark.parametrize(
    ("column", "reference", "head"),
    [
        ("same", [2.0, 2.0], ["same", "difference from 2, %"]),
        ("own", [2.0, 4.0], ["own", "reference", "difference, %"]),
        ("none", [0.0, 0.0], ["none (0)"]),
        ("alone", [None, None], ["alone"]),
    ],
)
def test_a_table_says_a_reference_once(book: ModuleType, column: str, reference: list[float], head: list[str]) -> None:
    rows = {"d": [0.1, 0.2], "column": column, "value": [2.02, 4.0], "error": [0.1, None], "reference": reference}
    shown = book.shown(pd.DataFrame(rows | {"allowed": 1.0}), {"keys": ["d"], "compare": {column: {}}})
    assert list(shown.columns) == ["d", *head]
    assert shown[head[0]].tolist() == ["2.02\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}0.10", "4"]


def test_values_that_are_too_far_off_are_found(book: ModuleType) -> None:
    table = pd.DataFrame(
        {"value": [1.01, 1.01, 0.1, 5.0], "reference": [1, 1, 0, None], "allowed": [0.02, 0.005, 0.2, 0.1]}
    )
    assert book.judged({"one": table})["good"].tolist() == [True, False, True]

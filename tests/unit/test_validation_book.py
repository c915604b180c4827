"""The validation book: pages are made of the results, references have sources, differences are as small as said."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import ModuleType

import pytest
from support.inputs import ROOT

BOOK = ROOT / "docs" / "validation"


@pytest.fixture(scope="module")
def book() -> Iterator[ModuleType]:
    """The script that writes the pages."""
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        import validation

        yield validation
    finally:
        sys.path.remove(str(ROOT / "scripts"))


def test_no_number_of_a_page_was_typed(book: ModuleType) -> None:
    assert list(book.all_results()) == list(book.TITLES)
    made = book.pages()
    assert set(made) == {path.name for path in BOOK.glob("*.md")}
    for name, text in made.items():
        assert (BOOK / name).read_text() == text, "written by scripts/validation all --pages"


def test_every_table_has_its_place(book: ModuleType) -> None:
    from book.pages import marks

    for name, found in book.all_results().items():
        assert marks((BOOK / f"{name}.md").read_text()) == set(book.blocks(found))


def test_page_of_speed_is_that_of_the_stored_results(book: ModuleType) -> None:
    import accuracy
    from book.pages import filled, marks

    page = accuracy.PAGE.read_text()
    assert marks(page) <= set(accuracy.blocks())
    assert filled(page, accuracy.blocks()) == page, "written by scripts/accuracy --page"


def test_differences_are_as_small_as_allowed(book: ModuleType) -> None:
    rows = [row for found in book.all_results().values() for row in found.comparisons]
    assert len(rows) > 80
    assert not [row for row in rows if not row.good]


def test_every_reference_has_a_source_and_is_used(book: ModuleType) -> None:
    content = book.references()
    groups = content["groups"].values()
    assert {group["source"] for group in groups} == set(content["sources"])
    used = {row.exact for found in book.all_results().values() for row in found.comparisons}
    assert {float(value) for group in groups for value in group["values"].values()} <= used

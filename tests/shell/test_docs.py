"""The documentation: line lengths, and completeness of the lists of files and columns."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from support.inputs import ROOT

from pairsim.cases.example import write_example
from pairsim.cases.run_case import Case
from pairsim.computing import QUESTIONS, own_files
from pairsim.computing.case_files import read_case
from pairsim.computing.question import LAST
from pairsim.results.columns import STUDY_COLUMNS, SWEEP_COLUMNS, column
from pairsim.results.folder import PICTURE_ENDINGS
from pairsim.sweeps.study import COUNTS

WIDTH = 100
PAGES = sorted(
    [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("configs/*.md"), *ROOT.glob("scripts/**/*.md")]
)
CASE = {"beta": 0.4, "De": 1, "Ca_e": 0.1}


def prose(text: str) -> str:
    """A page with its tables, fenced blocks and HTML comments left blank."""
    for pattern in (r"^ *```.*?^ *```$", r"<!--.*?-->", r"^ *\|.*?$"):
        text = re.sub(pattern, lambda match: "\n" * match[0].count("\n"), text, flags=re.DOTALL | re.MULTILINE)
    return text


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_prose_wraps(page: Path) -> None:
    long = [n for n, line in enumerate(prose(page.read_text()).splitlines(), 1) if len(line) > WIDTH and " " in line]
    assert not long, f"lines {long} are longer than {WIDTH} characters"


def test_every_file_is_described() -> None:
    page = (ROOT / "docs" / "reference" / "files.md").read_text()
    others = tuple(f".{ending}" for ending in PICTURE_ENDINGS if ending != "png")  # the page names them once
    assert not [name for name in own_files() if f"`{name}`" not in page and not name.endswith(others)]
    assert all(f"`{ending}`" in page for ending in others)


@pytest.mark.parametrize("name", QUESTIONS)
def test_columns_of_sweeps_are_described(name: str, tmp_path: Path) -> None:
    known = {each.name for each in SWEEP_COLUMNS} | Case.model_fields.keys()
    shown = QUESTIONS[name].in_sweeps
    columns = shown.columns(read_case(QUESTIONS[name], write_example(name, name, tmp_path)))
    assert all(column(entry) for entry in (*shown.parameters, *columns, *LAST) if entry not in known)


def test_counts_of_studies_are_described() -> None:
    assert not set(COUNTS) - {column.name for column in STUDY_COLUMNS}


def test_pages_that_files_name_exist() -> None:
    """Code, tests and README name pages of docs, which move."""
    parts = ("*.md", "configs/*.md", "pairsim/**/*.py", "scripts/*", "tests/**/*.py")
    files = [path for part in parts for path in ROOT.glob(part) if path.is_file()]
    named = {(path, page) for path in files for page in re.findall(r"\bdocs/[\w/.-]+\.(?:md|png)\b", path.read_text())}
    assert named
    assert not [f"{path}: {page}" for path, page in named if not (ROOT / page).exists()]

"""The documentation: line lengths, complete lists, and its site, built with warnings as errors, read offline."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from support.inputs import ROOT

from pairsim.app.command_line import app, command_of
from pairsim.cases.example import write_example
from pairsim.cases.kinds_of_cases import has_example
from pairsim.computing.case_files import read_case
from pairsim.computing.question import own_files
from pairsim.computing.schema import schema_rows
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import PICTURE_ENDINGS
from pairsim.sweeps.files import FILES

sys.path.append(str(ROOT / "scripts"))

import docs_reference

WIDTH = 100
PAGES = sorted(
    [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("configs/*.md"), *ROOT.glob("scripts/**/*.md")]
)


def prose(text: str) -> str:
    """A page with its tables, fenced blocks and HTML comments left blank."""
    for pattern in (r"^ *```.*?^ *```$", r"<!--.*?-->", r"^ *\|.*?$"):
        text = re.sub(pattern, lambda match: "\n" * match[0].count("\n"), text, flags=re.DOTALL | re.MULTILINE)
    return text


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_prose_wraps(page: Path) -> None:
    long = [n for n, line in enumerate(prose(page.read_text()).splitlines(), 1) if len(line) > WIDTH and " " in line]
    assert not long, f"lines {long} are longer than {WIDTH} characters"


def test_reference_pages_are_those_of_the_code() -> None:
    stored = {path.name: path.read_text() for path in docs_reference.PAGES.glob("*.md")}
    made = docs_reference.pages()
    stale = [name for name, text in made.items() if stored.get(name) != text]
    assert not stale, "python scripts/docs_reference.py writes them"
    assert stored.keys() == made.keys()


def test_pages_are_read_as_they_are() -> None:
    """Nothing in the copy of the project is left to be filled in."""
    left = re.compile(r"\{\{|\{%|^::: ", re.MULTILINE)
    filled_in = {path.name for path in ROOT.glob("docs/**/*.md") if left.search(prose(path.read_text()))}
    assert filled_in == {"add-question.md"}  # whose braces are those of a format


def test_terms_of_the_numerics_name_what_is_in_the_code() -> None:
    """Each row of the table from the equations to the code names files, each with what it defines."""
    page = (ROOT / "docs/explanation/numerics.md").read_text()
    (table,) = re.findall(r"^## From the equations to the code\n(.*?)^## ", page, flags=re.DOTALL | re.MULTILINE)
    rows = [
        line.rsplit(" | ", 1)[1] for line in table.splitlines() if line.startswith("| ") and "file: object" not in line
    ]
    for row in rows:
        for part in row.strip(" |").split("; "):
            file, *names = re.findall(r"`([^`]+)`", part)
            code = (ROOT / "pairsim" / file).read_text()
            assert names, row
            for name in names:
                assert re.search(rf"^(def|class) {name}\b", code, flags=re.MULTILINE), f"{file} has no {name}"
    assert len(rows) > 40


def test_every_file_is_described() -> None:
    page = (ROOT / "docs" / "reference" / "files.md").read_text()
    others = tuple(f".{ending}" for ending in PICTURE_ENDINGS if ending != "png")  # the page names them once
    assert not [name for name in own_files(QUESTIONS.values()) if f"`{name}`" not in page and not name.endswith(others)]
    assert all(f"`{ending}`" in page for ending in others)


@pytest.mark.parametrize("name", [*filter(has_example, QUESTIONS)])
def test_columns_of_sweeps_are_described(name: str, tmp_path: Path) -> None:
    question = QUESTIONS[name]
    columns = question.in_sweeps.columns(read_case(question, write_example(name, name, tmp_path)))
    assert all(question.sweep_columns.column(entry).meaning for entry in columns)


def test_pages_that_files_name_exist() -> None:
    """Code, tests and README name pages of docs, which move."""
    parts = ("*.md", "configs/*.md", "pairsim/**/*.py", "scripts/*", "tests/**/*.py")
    files = [path for part in parts for path in ROOT.glob(part) if path.is_file()]
    named = {(path, page) for path in files for page in re.findall(r"\bdocs/[\w/.-]+\.(?:md|png)\b", path.read_text())}
    assert named
    assert not [f"{path}: {page}" for path, page in named if not (ROOT / page).exists()]


def shell_lines(page: Path) -> list[list[str]]:
    """The first command of each line of the blocks for a shell, as words."""
    blocks = re.findall(r"^```sh\n(.*?)^```$", page.read_text(), re.DOTALL | re.MULTILINE)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    return [shlex.split(re.split(r" (?:\||>|&&) ", line)[0], comments=True) for line in lines]


def is_known(words: list[str]) -> bool:
    """Whether there is such a script, or such a command of pairsim with these options."""
    program, *rest = words
    if program.startswith("scripts/") and not (ROOT / program).is_file():
        return False
    if program not in ("pairsim", "scripts/pairsim", ".venv/bin/pairsim") or rest[:1] in (
        [],
        ["--version"],
        ["--help"],
    ):
        return True
    if rest[0] not in typer.main.get_command(app).commands:
        return False
    known = {"--help", "--laws"}.union(*([*each.opts, *each.secondary_opts] for each in command_of(rest[0]).params))
    return {word.partition("=")[0] for word in rest[1:] if re.match(r"--?[a-zA-Z]", word)} <= known


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_and_options_of_the_pages_exist(page: Path) -> None:
    assert [" ".join(words) for words in shell_lines(page) if words and not is_known(words)] == []


def links(page: Path) -> set[Path]:
    """The pages of the project that a page links to."""
    named = re.findall(r"\]\(([^)#\s]+\.md)(?:#[^)]*)?\)", page.read_text())
    return {(page.parent / each).resolve() for each in named if "://" not in each}


@pytest.mark.parametrize("start", ["README.md", "docs/index.md"])
def test_every_page_is_found_in_two_clicks(start: str) -> None:
    first = links(ROOT / start)
    found = {ROOT / start} | first | {page for each in first for page in links(each)}
    assert [str(page.relative_to(ROOT)) for page in sorted(ROOT.glob("docs/**/*.md")) if page not in found] == []


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; internal links and anchors are checked by mkdocs."""
    folder = tmp_path_factory.mktemp("site")
    quiet = {"NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, env=os.environ | quiet, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


@pytest.mark.slow
def test_reference_has_every_key_and_command(site: Path) -> None:
    keys = (site / "reference" / "case-files.html").read_text()
    for command in FILES:
        assert not [row[0] for row in schema_rows(FILES[command]) if f"<code>{row[0]}</code>" not in keys]
    commands = (site / "reference" / "cli.html").read_text()
    names = list(typer.main.get_command(app).commands)
    assert "run" in names
    assert not [name for name in names if f"<code>pairsim {name}</code>" not in commands]


@pytest.mark.slow
def test_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    """Equations are part of the pages, fonts and scripts are files of the site."""
    loaded = re.compile(r"<(?:script|img|iframe)[^>]*\ssrc=\"?(?:https?:)?//|<link[^>]*rel=\"?stylesheet\"?[^>]*//")
    assert not [page for page in site.rglob("*.html") if loaded.search(page.read_text())]
    physics = (site / "explanation" / "physics.html").read_text()
    assert physics.count("<math") > 50
    assert "\\boldsymbol" not in physics.replace("\\\\", "")

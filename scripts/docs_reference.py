"""Writes the pages of docs/reference that are made from the code, by the templates in scripts/reference.

usage: .venv/bin/python scripts/docs_reference.py

A test fails where a page differs from what this writes. As a hook of mkdocs it lets mkdocstrings make the page on
Python.
"""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from pkgutil import resolve_name
from tempfile import TemporaryDirectory
from typing import Any

import typer
from jinja2 import Environment, StrictUndefined
from typer.cli import get_docs_for_click

import pairsim
from pairsim.app.command_line import app, command_of
from pairsim.cases.example import write_example
from pairsim.cases.kinds_of_cases import has_example
from pairsim.computing.case_files import read_case
from pairsim.computing.schema import schema_rows
from pairsim.quantities.kinds import PURE, SECONDS
from pairsim.questions.compute import Computation
from pairsim.questions.registry import QUESTIONS
from pairsim.record import columns as shared
from pairsim.record.column import Column, Columns
from pairsim.record.columns import COST
from pairsim.record.folder import write_text
from pairsim.runtime import errors
from pairsim.runtime.errors import BranchEnd, kinds_of_failures
from pairsim.sweeps import study_table
from pairsim.sweeps.files import FILES

ROOT = Path(__file__).resolve().parent.parent
TEMPLATES, PAGES, CONFIGS = ROOT / "scripts" / "reference", ROOT / "docs" / "reference", ROOT / "configs"
WIDTH = 100  # of lines of prose
MADE = "<!-- Made by scripts/docs_reference.py of scripts/reference/{} and the code. -->\n\n"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Format a table in Markdown."""
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


def escaped(text: str) -> str:
    """Text with the special characters of Markdown and HTML escaped; an underscore within a word is none of them."""
    return re.sub(r"([\\<>|*\[`]|(?<!\w)_|_(?!\w))", r"\\\1", text)


def code(text: str) -> str:
    """Text formatted as code in a cell of a table; empty for empty text."""
    return f"`{text}`" if text else ""


def table_of_keys(rows: Iterable[tuple[str, str, str, str]]) -> str:
    """Table with key, allowed values, default and meaning."""
    cells = [(code(key), escaped(allowed), code(default), escaped(meaning)) for key, allowed, default, meaning in rows]
    return table(("key", "allowed", "default", "meaning"), cells)


def table_of_columns(*groups: Column | Iterable[Column], n: int = 2) -> str:
    """Table with name, symbol, meaning and unit of the columns of tables of `n` particles."""
    rows, columns = [], Columns(*groups)
    for entry in map(columns.column, columns.named(n)):
        unit = entry.unit.name if entry.unit in (PURE, SECONDS) else f"${entry.unit.tex}$"
        rows.append((code(entry.name), f"${entry.symbol}$" if entry.symbol else "", escaped(entry.meaning), unit))
    return table(("column", "symbol", "meaning", "unit"), rows)


def numbered(columns: Iterable[Column]) -> list[Column]:
    """Those of the columns that exist for every gap or particle, with `_i` for its number."""
    return [replace(entry.with_suffix("_i"), of="") for entry in columns if entry.of]


def other_files() -> list[str]:
    """Rows with the tables and pictures of questions that the page on files does not describe in words of its own."""
    page, rows = (TEMPLATES / "files.md").read_text(), list[str]()
    for name, question in QUESTIONS.items():
        tables_ = {f"{each}.csv": f"[its columns](columns.md#{each}csv)" for each in question.tables}
        found = tables_ | {f"{each}.png": caption for each, caption in question.captions.items()}
        rows += [f"| `{file}` | {name} | {what} |" for file, what in found.items() if f"`{file}`" not in page]
    return rows


def in_sweeps(name: str) -> str:
    """Columns of results.csv for a sweep of a command over a pair, as text."""
    command, shown = QUESTIONS[name], QUESTIONS[name].in_sweeps
    with TemporaryDirectory() as folder:
        columns = shown.columns(read_case(command, write_example(name, name, Path(folder))))
    return ", ".join(code(entry) for entry in (*shown.parameters, *columns, *(column.name for column in COST)))


def command_line() -> str:
    """All commands with their arguments and options."""
    command: Any = typer.main.get_command(app)
    command.commands = {name: command_of(name) for name in command.commands}
    text = get_docs_for_click(obj=command, ctx=typer.Context(command), name="pairsim", title="Command line")
    told = {name: str(each.help).splitlines()[0] for name, each in command.commands.items()}  # whole in the list, too
    text = re.sub(r"^\* `(\w[\w-]*)`: .*$", lambda found: f"* `{found[1]}`: {told[found[1]]}", text, flags=re.MULTILINE)
    text = re.sub(r"^Examples?: (.*)$", _examples, text, flags=re.MULTILINE)
    return re.sub(r"`[^`]*`|<", lambda found: "&lt;" if found[0] == "<" else found[0], text)  # code is left as it is


def _examples(found: re.Match[str]) -> str:
    """The examples at the end of a help text as code, one a line."""
    return "\n".join(["```sh", *found[1].split(" | "), "```"])


def failures() -> str:
    """Table with the reasons of failures."""
    rows = [
        (code(kind.reason), escaped((kind.__doc__ or "").strip().splitlines()[0]), kind.remedy)
        for kind in kinds_of_failures()
        if kind is not BranchEnd  # which is an answer
    ]
    return table(("reason", "meaning", "what helps"), rows)


def public_names() -> list[str]:
    """Public names of the package, functions first."""
    names = [f"pairsim.{name}" for name in pairsim.__all__ if callable(getattr(pairsim, name))]
    names += [f"pairsim.errors.{name}" for name in errors.__all__ if f"pairsim.{name}" not in names]
    names += ["pairsim.questions.compute.Computation"]
    return sorted(names, key=lambda name: (name.startswith("pairsim.errors"), name.rpartition(".")[2][0].isupper()))


def stub(name: str) -> str:
    """Signature and docstring of a public name, and of what a class has itself, without code."""
    return "\n".join(_stub(name.rpartition(".")[2], resolve_name(name), ""))


def _stub(name: str, what: Any, indent: str) -> Iterator[str]:
    inside = f"{indent}    "
    text = inspect.getdoc(what) or ""
    if isinstance(what, Computation):
        text = text.splitlines()[0] + " Arguments are those of Computation."
    if inspect.isclass(what):
        bases = ", ".join(base.__name__ for base in what.__bases__ if base is not object)
        yield f"{indent}class {name}{f'({bases})' if bases else ''}:"
    else:
        yield f"{indent}def {name}{_arguments(what, indent)}:"
    if text:
        end = f"\n{inside}" if "\n" in text else ""
        yield textwrap.indent(f'"""{text}', inside) + f'{end}"""'
    for member, value in vars(what).items() if inspect.isclass(what) else ():
        of_instance = getattr(value, "func", None) or getattr(value, "fget", None)  # a property, cached or not
        function = of_instance or getattr(value, "__func__", value)
        if inspect.isfunction(function) and (not member.startswith("_") or member == "__call__"):
            yield from ["", f"{inside}@property"] if of_instance else [""]
            yield from _stub(member, function, inside)


def _arguments(what: Callable[..., Any], indent: str) -> str:
    """The arguments of a function and what it returns; arguments have a line each where they are long."""
    signature, given = inspect.signature(what), list[str]()
    for each in signature.parameters.values():
        if each.kind is each.KEYWORD_ONLY and not any(one.startswith("*") for one in given):
            given.append("*")
        stars = "*" if each.kind is each.VAR_POSITIONAL else "**" if each.kind is each.VAR_KEYWORD else ""
        annotation = "" if each.annotation is each.empty else f": {each.annotation}"
        default = "" if each.default is each.empty else f" = {each.default!r}".replace("'", '"')
        given.append(f"{stars}{each.name}{annotation}{default}")
    kind = what.question.result.__name__ if isinstance(what, Computation) else signature.return_annotation
    returned = "" if kind is signature.empty else f" -> {kind}"
    if len(text := f"({', '.join(given)}){returned}") < WIDTH - len(indent):
        return text
    return "(\n" + "".join(f"{indent}    {each},\n" for each in given) + f"{indent}){returned}"


def wrapped(text: str) -> str:
    """The text with long lines of prose and of lists wrapped; tables and code are left as they are."""
    lines, in_code = [], False
    for line in text.splitlines():
        in_code ^= line.startswith("```")
        if len(line) > WIDTH and not in_code and not line.startswith("|"):
            inside = " " * (2 if line.startswith(("* ", "- ")) else 0)
            line = textwrap.fill(line, WIDTH, subsequent_indent=inside, break_long_words=False, break_on_hyphens=False)
        lines.append(line)
    return "\n".join(lines).rstrip() + "\n"


@cache
def environment() -> Environment:
    """Jinja with all names that the pages use."""
    functions = (table_of_keys, table_of_columns, other_files, in_sweeps, command_line, failures, public_names, stub)
    keys = {command: schema_rows(model) for command, model in FILES.items()}
    jinja = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    jinja.globals |= {function.__name__: function for function in functions} | {
        "commands": QUESTIONS,
        "with_example": [*filter(has_example, QUESTIONS)],
        "keys": keys,
        "shared_keys": [row for row in keys["run"] if all(row in keys[command] for command in QUESTIONS)],
        "remedy_beyond_a_branch": BranchEnd.remedy,
        "shared": shared,
        "study": study_table,
        "numbered": numbered,
        "examples": {path.name: path.read_text() for path in sorted(CONFIGS.glob("*.yaml"))},
    }
    return jinja


def pages() -> dict[str, str]:
    """The text of every page by its file."""
    found = {}
    for path in sorted(TEMPLATES.glob("*.md")):
        text = re.sub(r"\n{3,}", "\n\n", environment().from_string(path.read_text()).render())
        found[path.name] = MADE.format(path.name) + wrapped(text)
    return found


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Let mkdocstrings fill in the page on Python; called by mkdocs."""
    if page.file.src_uri != "reference/api.md":
        return markdown
    head = markdown.partition("\n## ")[0]
    return "\n\n".join([head, *(f"::: {name}" for name in public_names())])


if __name__ == "__main__":
    for file, written in pages().items():
        write_text(PAGES / file, written)
        print(PAGES / file)

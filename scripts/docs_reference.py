"""Hook of mkdocs that fills in docs/reference, whose pages are Jinja templates, from the code."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import cache
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import typer
from jinja2 import Environment, StrictUndefined
from typer.cli import get_docs_for_click

import pairsim
from pairsim.cases.example import write_example
from pairsim.cli.app import app, command_of
from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import FILES, read_case
from pairsim.computing.question import LAST
from pairsim.computing.schema import schema_rows
from pairsim.results import columns as tables
from pairsim.results.columns import Column, column
from pairsim.results.units import PURE, SECONDS
from pairsim.runtime import errors
from pairsim.runtime.errors import RunFailure

CONFIGS = Path(__file__).resolve().parent.parent / "configs"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Format a table in Markdown."""
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


def escaped(text: str) -> str:
    """Text with the special characters of Markdown and HTML escaped."""
    return re.sub(r"([\\<>|*_\[`])", r"\\\1", text)


def code(text: str) -> str:
    """Text formatted as code in a cell of a table; empty for empty text."""
    return f"`{text}`" if text else ""


def table_of_keys(rows: Iterable[tuple[str, str, str, str]]) -> str:
    """Table with key, allowed values, default and meaning."""
    cells = [(code(key), escaped(allowed), code(default), escaped(meaning)) for key, allowed, default, meaning in rows]
    return table(("key", "allowed", "default", "meaning"), cells)


def table_of_columns(*groups: Iterable[str | Column]) -> str:
    """Table with name, symbol, meaning and unit of columns."""
    rows = []
    for entry in (column(each) if isinstance(each, str) else each for each in chain(*groups)):
        unit = entry.unit.name if entry.unit in (PURE, SECONDS) else f"${entry.unit.tex}$"
        rows.append((code(entry.name), f"${entry.symbol}$" if entry.symbol else "", escaped(entry.meaning), unit))
    return table(("column", "symbol", "meaning", "unit"), rows)


def in_sweeps(name: str) -> str:
    """Columns of results.csv for a sweep of a command over a pair, as text."""
    command, shown = QUESTIONS[name], QUESTIONS[name].in_sweeps
    with TemporaryDirectory() as folder:
        columns = shown.columns(read_case(command, write_example(name, name, Path(folder))))
    return ", ".join(code(entry) for entry in (*shown.parameters, *columns, *LAST))


def command_line() -> str:
    """All commands with their arguments and options."""
    command: Any = typer.main.get_command(app)
    command.commands |= {name: command_of(name) for name in QUESTIONS}
    text = get_docs_for_click(obj=command, ctx=typer.Context(command), name="pairsim", title="Command line")
    return re.sub(r"`[^`]*`|<", lambda found: "&lt;" if found[0] == "<" else found[0], text)  # code is left as it is


def failures() -> str:
    """Table with the reasons of failures."""
    kinds = [(kind.reason, (kind.__doc__ or "").strip().splitlines()[0]) for kind in RunFailure.__subclasses__()]
    return table(("reason", "meaning"), [(code(reason), escaped(meaning)) for reason, meaning in kinds])


def public_names() -> list[str]:
    """Public names of the package, functions first."""
    names = [f"pairsim.{name}" for name in pairsim.__all__ if callable(getattr(pairsim, name))]
    names += [f"pairsim.errors.{name}" for name in errors.__all__ if f"pairsim.{name}" not in names]
    names += ["pairsim.api.compute.Computation"]
    return sorted(names, key=lambda name: (name.startswith("pairsim.errors"), name.rpartition(".")[2][0].isupper()))


@cache
def environment() -> Environment:
    """Jinja with all names that the pages use."""
    functions = (table_of_keys, table_of_columns, in_sweeps, command_line, failures, public_names)
    keys = {command: schema_rows(command) for command in FILES}
    jinja = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    jinja.globals |= {function.__name__: function for function in functions} | {
        "commands": QUESTIONS,
        "keys": keys,
        "shared_keys": [row for row in keys["run"] if all(row in keys[command] for command in QUESTIONS)],
        "tables": tables,
        "curve_columns": tables.curve_columns(2, True, ("Ca_e", "De", "beta"), True),
        "numbered_columns": [entry.with_suffix("_i") for entry in tables.COLUMNS if entry.of],
        "examples": {path.name: path.read_text() for path in sorted(CONFIGS.glob("*.yaml"))},
    }
    return jinja


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Fill in a page of docs/reference; called by mkdocs."""
    return environment().from_string(markdown).render() if page.file.src_uri.startswith("reference/") else markdown

"""Script of mkdocs-gen-files that generates the pages of docs/reference from the code when the site is built."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import mkdocs_gen_files
import typer
from typer.cli import get_docs_for_click

import pairsim
from pairsim.cli.app import app
from pairsim.commands import COMMANDS, Command
from pairsim.config.example import example_of
from pairsim.config.yaml_file import DEEPEST, LARGEST_FILE, MOST_VALUES
from pairsim.inputs.case_files import FILES, parse_case
from pairsim.inputs.schema import schema_rows
from pairsim.results import columns as tables
from pairsim.results.columns import Column, column
from pairsim.runtime import errors
from pairsim.runtime.errors import RunFailure

ROOT = Path(__file__).resolve().parent.parent


def escaped(text: str) -> str:
    """Text with the special characters of Markdown and HTML escaped."""
    for special in ("\\", "<", ">", "|", "*", "_", "[", "`"):
        text = text.replace(special, "\\" + special)
    return text


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Format a table in Markdown."""
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows]) + "\n"


def code(text: str) -> str:
    """Text formatted as code in a cell of a table; empty for empty text."""
    return f"`{text}`" if text else ""


def case_files() -> str:
    """Page with the keys of the case files of all commands."""
    parts = [
        "# Case files\n",
        "Keys of the YAML files that each command reads. Dotted keys are nested: `mesh.Np` is the key `Np` in the "
        "group `mesh`. Units are in brackets; quantities without one are dimensionless "
        "([definitions](../explanation/physics.md#dimensionless-numbers)).\n",
        "Files are YAML 1.2 with decimal numbers: `010` and `1:30`, which YAML 1.1 reads as 8 and 90, are no numbers, "
        f"`yes` and `no` are words. Tags are refused. A file has at most {LARGEST_FILE / 1e6:g} MB, {MOST_VALUES:,} "
        f"keys and values, and {DEEPEST} groups and lists within each other.\n",
    ]
    rows = {command: schema_rows(command) for command in FILES}
    shared = [row for row in rows["run"] if all(row in rows[command] for command in COMMANDS)]
    parts += ["## Keys of all cases\n", f"Of {', '.join(f'`pairsim {name}`' for name in COMMANDS)}.\n", keys(shared)]
    for command, own in rows.items():
        others = "The keys of all cases, and\n" if command in COMMANDS else ""
        parts += [f"## pairsim {command}\n", others, keys(row for row in own if row not in shared)]
    return "\n".join(parts)


def keys(rows: Iterable[tuple[str, str, str, str]]) -> str:
    """Table with key, allowed values, default and meaning."""
    cells = [(code(key), escaped(allowed), code(default), escaped(meaning)) for key, allowed, default, meaning in rows]
    return table(("key", "allowed", "default", "meaning"), cells)


def described(entries: Iterable[Column]) -> str:
    """Table with name, symbol, meaning and unit of columns."""
    rows = []
    for entry in entries:
        unit = entry.unit if entry.unit in ("", "s", "bytes") else f"${entry.unit}$"
        rows.append((code(entry.name), f"${entry.symbol}$" if entry.symbol else "", escaped(entry.meaning), unit))
    return table(("column", "symbol", "meaning", "unit"), rows)


def column_pages() -> str:
    """Page with the columns of all tables, in their order."""
    liquid = "\nIn a viscoelastic liquid these follow:\n"
    polymer = described(map(column, tables.POLYMER_HEALTH))
    many = [tables.COLUMNS[i] for i in range(len(tables.COLUMNS)) if tables.COLUMNS[i].name.endswith("_i")]
    curve = tables.curve_columns(2, True, ("Ca_e", "De", "beta"), True)
    critical = [*tables.CRITICAL_COLUMNS]
    parts = [
        "# Columns of the tables\n",
        "All tables are CSV with one line of column names. Units: lengths in tube diameters $D_c$, velocities in the "
        "mean velocity $U_{av}$, times in $D_c/U_{av}$, stresses in $\\eta_0 U_{av}/D_c$.\n",
        "## series.csv\n",
        "Of `pairsim run`: one row for each accepted time step, on disk as soon as it is computed. There is no row at "
        "t = 0, where an undeformed elastic particle has no unique velocity field.\n",
        described(map(column, [*tables.series_columns(2), *tables.HEALTH])) + liquid,
        polymer,
        "With one particle, or more than two, columns are numbered from upstream, such as `d_1`, `d_2`, `U_3`:\n",
        described(many),
        "## curve.csv\n",
        "Of `pairsim curve`: one row for each distance. The columns "
        "`by_...` are there with `--sensitivities`, the columns `F...` where the case has `velocity`.\n",
        described(map(column, [*curve, *tables.CURVE_HEALTH])) + liquid,
        polymer,
        "## equilibria.csv\n",
        "Of `pairsim curve`: one row for each zero of dU.\n",
        described(map(column, tables.EQUILIBRIA_COLUMNS)),
        "## critical.csv\n",
        "Of `pairsim critical`: one row for each critical distance on each branch.\n",
        described(map(column, [*critical, *tables.CURVE_HEALTH])) + liquid,
        polymer,
        *(part for command in COMMANDS.values() if command.columns for part in own_table(command)),
        "## results.csv\n",
        "Of `pairsim sweep`: one row for each case that has ended, with `folder`, `status`, `reason`, the parameters "
        "that the grid varies, and",
        *(f"\n- of `{name}`: {listed(name)}" for name, command in COMMANDS.items()),
        "\nColumns of a run are those of the last row of its series.csv. The others:\n",
        described(tables.SWEEP_COLUMNS),
        "## study.csv\n",
        "Of `pairsim study`: one row for each discretisation, with the keys that vary, dU and D at the last entry of "
        "`at`, and the columns below. Cells are empty where nothing is known.\n",
        described(tables.STUDY_COLUMNS),
    ]
    return "\n".join(parts)


def own_table(command: Command[Any]) -> tuple[str, ...]:
    """Section with the columns of the main table of a command."""
    entries = (each if isinstance(each, Column) else column(each) for each in command.columns)
    return f"## {command.tables[0]}.csv\n", f"Of `pairsim {command.name}`.\n", described(entries)


def listed(name: str) -> str:
    """Columns of results.csv for a sweep of a command over a pair, as text."""
    command, shown = COMMANDS[name], COMMANDS[name].in_sweeps
    columns = shown.columns(parse_case(command, example_of(name), ""))
    return ", ".join(code(entry) for entry in (*shown.parameters, *columns, *shown.last))


def cli() -> str:
    """Page with all commands, their arguments and options, and the reasons of failures."""
    command: Any = typer.main.get_command(app)
    command.commands = {name: getattr(each, "whole", each) for name, each in command.commands.items()}
    text = get_docs_for_click(obj=command, ctx=typer.Context(command), name="pairsim", title="Command line")
    lines = [line if line.startswith(("```", "$")) else line.replace("<", "&lt;") for line in text.splitlines()]
    reasons = [
        (code(kind.reason), escaped((kind.__doc__ or "").strip().splitlines()[0]))
        for kind in RunFailure.__subclasses__()
    ]
    end = [
        "",
        "## Reasons of failures",
        "",
        "A command that ends with exit code 3, or 4 for `environment`, writes one of these into run.json:",
        "",
    ]
    return "\n".join([*lines, *end, table(("reason", "meaning"), reasons)])


def api() -> str:
    """Page with the public names of the package."""
    names = [f"pairsim.{name}" for name in pairsim.__all__ if callable(getattr(pairsim, name))]
    names += [f"pairsim.errors.{name}" for name in errors.__all__ if f"pairsim.{name}" not in names]
    names += ["pairsim.statements", "pairsim.api.compute.Computation"]
    names.sort(key=lambda name: (name.startswith("pairsim.errors"), name.rpartition(".")[2][0].isupper()))
    head = "# Python API\n\nPublic names of `pairsim`. [From Python](../how-to/python.md) shows how to use them.\n\n"
    return head + "\n\n".join(f"::: {name}" for name in names) + "\n"


def examples() -> str:
    """Page with the case files in `configs/`."""
    parts = ["# Examples\n", "The files of `configs/`, as they are shipped.\n"]
    for path in sorted((ROOT / "configs").glob("*.yaml")):
        parts += [f"## {path.name}\n", f"```yaml\n{path.read_text()}```\n"]
    return "\n".join(parts)


PAGES: dict[str, Callable[[], str]] = {
    "case-files.md": case_files,
    "columns.md": column_pages,
    "cli.md": cli,
    "api.md": api,
    "examples.md": examples,
}

for page, make in PAGES.items():
    with mkdocs_gen_files.open(f"reference/{page}", "w") as file:
        file.write(make())

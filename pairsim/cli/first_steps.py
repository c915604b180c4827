"""First commands: commented examples, the list of keys, and a check of the installation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pairsim.cli.options import OfExamples, OfFiles, Settings, path_option, print_table
from pairsim.runtime.errors import EnvironmentFailure, InputError, PairsimError

app = typer.Typer()


@app.command(epilog="Examples: pairsim init | pairsim init beads --kind curve")
def init(
    name: Annotated[
        str | None, typer.Argument(help="Name of the case and of its file (default: the kind).", show_default=False)
    ] = None,
    kind: Annotated[OfExamples, typer.Option("--kind", help="The command that reads the file.")] = "run",
) -> None:
    """Write a commented example to NAME.yaml; an existing file is never replaced."""
    from pairsim.cases.example import write_example

    path = write_example(kind, name or kind, Path())
    typer.echo(str(path))
    typer.echo(f"next: pairsim {kind} {path} --dry-run", err=True)


@app.command(epilog="Example: pairsim doctor")
def doctor() -> None:
    """Check the installation: versions and places of what is needed, and a small case.

    The first time forms are compiled, for some ten seconds.

    Exit codes: 0 cases can be computed, 4 they cannot.
    """
    from pairsim.api.doctor import findings

    try:
        for name, found in findings():
            typer.echo(f"{name}: {found}")
    except (PairsimError, ImportError) as error:
        typer.echo(f"pairsim: {error}", err=True)
        raise typer.Exit(EnvironmentFailure.exit_code) from None


@app.command(
    epilog="Examples: pairsim schema curve | pairsim schema run --case case.yaml | "
    "pairsim schema run --json > run.schema.json"
)
def schema(
    command: Annotated[OfFiles, typer.Argument(help="The command that reads the file.")] = "run",
    case: Annotated[
        Path | None, path_option("--case", words="Show the value of each key in this case, defaults included.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a JSON Schema, with which editors check files.")
    ] = False,
    set_: Settings = None,
) -> None:
    """List every key of a file with its allowed values, default, meaning and unit.

    Some defaults depend on the liquid and on the particles: --case (with --set)
    shows the values in a case.
    """
    from rich.table import Table

    from pairsim.computing.schema import json_schema, schema_rows, values_in

    if set_ and case is None:
        raise InputError("pairsim schema", "--set", None, "must be used with --case, whose keys it replaces")
    if as_json and case is not None:
        raise InputError("pairsim schema", "--json", None, "must be left out with --case")
    if as_json:
        typer.echo(json_schema(command))
        return
    here = values_in(command, case, tuple(set_ or ())) if case is not None else None
    table = Table("key", "allowed", "default" if here is None else "here", "meaning", box=None, pad_edge=False)
    for key, allowed, default, meaning in schema_rows(command):
        table.add_row(key, allowed, default if here is None else here.get(key, ""), meaning)
    print_table(table)

"""List every key of a file with its allowed values, default, meaning and unit."""

from __future__ import annotations

from typing import Annotated

import typer

from pairsim.app.options import OfFiles, print_table

EXAMPLES = "Examples: pairsim schema curve | pairsim schema run --json > run.schema.json"


def schema(
    command: Annotated[OfFiles, typer.Argument(help="The command that reads the file.")] = "run",
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a JSON Schema, with which editors can check files.")
    ] = False,
) -> None:
    from rich.table import Table

    from pairsim.computing.schema import json_schema, schema_rows
    from pairsim.sweeps.files import FILES

    if as_json:
        typer.echo(json_schema(command, FILES[command]))
        return
    table = Table("key", "allowed", "default", "meaning", box=None, pad_edge=False)
    for row in schema_rows(FILES[command]):
        table.add_row(*row)
    print_table(table)

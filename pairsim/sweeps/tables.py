"""The tables of all cases of a sweep as one: a row a step, point or zero, with the parameters that vary."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from pairsim.computing import QUESTIONS
from pairsim.results.folder import read_record
from pairsim.results.tables import table_of
from pairsim.results.units import scales_in
from pairsim.runtime.errors import InputError
from pairsim.sweeps.folder import read_sweep


def table_of_all(directory: Path, name: str | None, physical: bool | None, by_gap: bool = False) -> pd.DataFrame:
    """A table of all cases that have it, one below the other.

    Args:
        directory: Folder of a sweep.
        name: Name of the table without .csv, such as "equilibria"; None for the main one of the command.
        physical: Whether to convert to micrometres, seconds and pascals; None if all cases have a `physical` block.
        by_gap: Whether to make it tidy.

    Returns:
        The keys that vary in the sweep, each case's values repeated, then the columns of the table.

    Raises:
        InputError: The command has no such table, no case has it yet, or `physical` is set and a case has no
            `physical` block.
    """
    content = read_sweep(directory, values=False)
    question, varying = QUESTIONS[content["command"]], content["varying"]
    name, tables = name or question.table, question.tables
    if name not in tables:
        allowed = f"must be {' or '.join(tables)}, a table of `pairsim {content['command']}`"
        raise InputError(str(directory), "", name, allowed)
    cases = [case for case in content["cases"] if (directory / case["folder"] / f"{name}.csv").is_file()]
    if physical is None:
        physical = all(scales_in(read_record(directory / case["folder"])) for case in cases)
    parts = []
    for case in cases:
        part = table_of(directory / case["folder"], name, physical, by_gap)
        for place, key in enumerate(key for key in varying if key not in part):
            part.insert(place, key, [case["parameters"].get(key)] * len(part))
        parts.append(part)
    if not parts:
        raise InputError(str(directory), "", None, f"has no case with {name}.csv yet")
    units = parts[0].attrs["units"]
    found = pd.concat(parts, ignore_index=True)
    found.attrs["units"] = {key: units.get(key, "") for key in found}
    return found

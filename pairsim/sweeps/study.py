"""`pairsim study`: error and wall time of one case in several discretisations, which are the cases of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pairsim.cases.identity import RUNS
from pairsim.cases.mistakes import Mistake, input_error
from pairsim.cases.yaml_file import read_yaml
from pairsim.questions.registry import QUESTIONS
from pairsim.record.column import names_of
from pairsim.record.columns import STATE_COLUMNS, STEPS, UNKNOWNS
from pairsim.record.folder import write_text
from pairsim.record.record import Record
from pairsim.record.run_entries import STATUS
from pairsim.record.table_files import read_table, table_text
from pairsim.runtime.plain import Plain
from pairsim.sweeps.files import parse_file
from pairsim.sweeps.grid import Grid, grid_from
from pairsim.sweeps.study_file import StudyFile, check_study
from pairsim.sweeps.study_table import ERROR, FAMILIES, MEASURED, ORDERS, REFERENCE, RELATIVE_ERROR, TABLE, families
from pairsim.sweeps.sweep import Ending, Options, Workers, run_sweep, with_workers

SAME = 1e-9  # relative tolerance at which two times or distances count as equal


def read_study(path: Path, settings: Sequence[str] = ()) -> tuple[StudyFile, Grid]:
    """Read a study file; returns its keys, and the grid of its discretisations.

    Raises:
        InputError: The file or a case has mistakes; lists file, entry, key, value and what is allowed.
    """
    data = read_yaml(path)
    file = parse_file("study", StudyFile, check_study, data, str(path))
    at: dict[str, Plain] = {"d" if file.command == "curve" else "output.times": [*file.places]} if file.places else {}
    cases: list[Plain] = [{**entry, **at} for entry in file.discretisations]
    shared: dict[str, Plain] = {key: data[key] for key in ("name", "base", "command") if key in data}
    grid = grid_from(path, {**shared, "cases": cases}, settings, "discretisations")
    if file.quantity not in (known := names_of(grid.cases[0].case.n, *STATE_COLUMNS[1:])):
        raise input_error([Mistake("quantity", file.quantity, f"must be one of {', '.join(known)}")], data, str(path))
    if grid.duplicates:
        allowed = f"must all differ; {grid.duplicates} are equal to an earlier one"
        raise input_error([Mistake("discretisations", None, allowed)], data, str(path))
    return file, grid


def compute_study(
    path: Path, folder: Path | None, options: Options, settings: Sequence[str] = ()
) -> tuple[Ending, Path]:
    """Compute the cases of a study that are not finished yet, and write study.csv and study.png into its folder.

    The arguments are those of `pairsim study`.

    Returns:
        How its sweep has ended, and the folder.

    Raises:
        InputError: The study is invalid, the folder belongs to another one, or another command is writing to it.
    """

    def compute(workers: Workers) -> tuple[Ending, Path]:
        from pairsim.sweeps.study_plots import plot_study

        file, grid = read_study(path, settings)
        directory = folder or RUNS / grid.name
        ending = run_sweep(grid, directory, options, workers)
        table = study_table(file, grid, directory).dropna(axis="columns", how="all").convert_dtypes()
        rows = table.astype(object).where(table.notna(), None).to_numpy().tolist()
        write_text(directory / TABLE, table_text(list(table.columns), rows))
        plot_study(directory)
        return ending, directory

    return with_workers(compute)


def study_table(file: StudyFile, grid: Grid, directory: Path) -> pd.DataFrame:
    """The table study.csv, with a row for each discretisation in the order of the file."""
    compared = [f"{file.quantity}@{place:g}" for place in file.places] or [file.quantity]
    rows = [{**case.parameters, **_measured(directory / case.folder, file, compared)} for case in grid.cases]
    table = pd.DataFrame(rows, columns=[*grid.varying, *(column.name for column in MEASURED), *compared])
    values = table[compared].astype(float)
    whole = values.notna().all(axis=1)
    reference: Any = file.reference
    if reference == "finest":
        by_size = table[whole].fillna({STEPS.name: 0}).sort_values([UNKNOWNS.name, STEPS.name])
        reference = by_size.index[-1] if len(by_size) else None
    table[REFERENCE.name] = table.index == reference
    exact = values.loc[reference] if reference is not None else values.max() * np.nan
    table[ERROR.name] = (values[whole & ~table[REFERENCE.name]] - exact).abs().max(axis=1)
    table[RELATIVE_ERROR.name] = table[ERROR.name] / (exact.abs().max() or np.nan)
    for family in FAMILIES:
        for group in families(table[whole], family):
            table.loc[group.index, ORDERS[family].name] = group["order"]
    return table


def _measured(folder: Path, file: StudyFile, compared: Sequence[str]) -> dict[str, str | float | None]:
    """Status and counts of a discretisation, and its compared values once it has finished."""
    record = Record.of({STATUS: "pending"}) | Record.read(folder)
    row = {column.name: record.get(column.name) for column in MEASURED}
    if record.status != "finished":
        return row
    series = read_table(folder / f"{QUESTIONS[file.command].table}.csv")
    axis = next(iter(series.values()))
    at = np.array(file.places or axis[-1:])
    nearest = np.abs(axis[:, None] - at).argmin(axis=0)
    reached = np.allclose(axis[nearest], at, rtol=SAME, atol=SAME)
    return row | (dict(zip(compared, series[file.quantity][nearest], strict=True)) if reached else {})

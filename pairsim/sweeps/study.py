"""`pairsim study`: error and wall time of one case in several discretisations.

Each discretisation is a case of a sweep, and each repetition a sweep of its own, in the folders sweep-1, sweep-2, ...
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pairsim.cases.mistakes import Mistake, input_error
from pairsim.cases.yaml_file import Section, places_in, read_yaml
from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import check_file
from pairsim.computing.many_cases import StudyFile, check_study
from pairsim.results.columns import series_columns
from pairsim.results.folder import read_record, write_text
from pairsim.results.table_files import read_table, table_text
from pairsim.sweeps.grid import Grid, grid_from

TABLE = "study.csv"
FAMILIES = {"space": "mesh.", "time": "time."}
"""Discretisations that differ only in keys with one of these prefixes form a family, for which orders are computed."""
COUNTS = ("unknowns", "steps", "newton_iterations", "factorisations")
MEASURED = ("status", "reason", *COUNTS, "wall_time", "wall_time_spread")
INTERRUPTED = 130  # exit code
SAME = 1e-9  # relative tolerance at which two times or distances count as equal


def read_study(path: Path, settings: tuple[str, ...] = ()) -> tuple[StudyFile, list[Grid]]:
    """Read a study file; returns its keys, and a grid for each repetition, the first one with all discretisations.

    Raises:
        InputError: The file or a case has mistakes; lists file, entry, key, value and what is allowed.
    """
    data = read_yaml(path)
    file, wrong = check_file("study", StudyFile, check_study, data, str(path))
    if file is not None and not wrong:
        names = [f"discretisations[{i}]" for i in range(len(file.discretisations))]
        by_count = {n: grid_from(path, _grid_file(file, data, n), settings, names) for n in sorted({*file.repeats})}
        grids = [next(by_count[n] for n in by_count if n > i) for i in range(max(file.repeats))]
        known = series_columns(grids[0].cases[0].resolved["particles"])[1:]
        if file.quantity not in known:
            wrong.append(Mistake("quantity", file.quantity, f"must be one of {', '.join(known)}"))
        if equal := grids[0].duplicates:
            wrong.append(Mistake("discretisations", None, f"must all differ; {equal} are equal to an earlier one"))
    if file is None or wrong:
        raise input_error(wrong, data, str(path))
    return file, grids


def _grid_file(file: StudyFile, data: dict[str, Any], repetitions: int) -> dict[str, Any]:
    """The content of the grid file of the discretisations with at least so many repetitions."""
    at = {"d" if file.command == "curve" else "output.times": file.at} if file.at else {}
    cases = []
    for entry, count in zip(data["discretisations"], file.repeats, strict=True):
        if count >= repetitions:
            changes = {key: value for key, value in entry.items() if key != "repeat"}
            cases.append(Section(changes | at, places_in(entry)))
    return {key: data[key] for key in ("name", "base", "command") if key in data} | {"cases": cases}


def run_study(
    file: StudyFile, grids: Sequence[Grid], directory: Path, sweep: Callable[[Grid, Path], tuple[int, str]]
) -> tuple[int, str]:
    """Compute the cases of a study that are not finished yet, and write study.csv and study.png into its folder.

    Args:
        file, grids: The study, from `read_study`.
        directory: Its folder; created, or continued if it exists.
        sweep: Computes a grid into a folder; returns exit code and message, as this function does for the worst sweep.

    Raises:
        InputError: The folder belongs to another study, or another command is writing to it.
    """
    from pairsim.sweeps.study_plots import plot_study

    done: list[tuple[int, str]] = []
    for i, grid in enumerate(grids):
        done.append(sweep(grid, directory / f"sweep-{i + 1}"))
        if done[-1][0] == INTERRUPTED:
            break
    worst = max(done, key=lambda each: each[0])
    table = study_table(file, grids, directory).dropna(axis="columns", how="all").convert_dtypes()
    rows = table.astype(object).where(table.notna(), None).to_numpy().tolist()
    write_text(directory / TABLE, table_text(list(table.columns), rows))
    plot_study(directory)
    return worst


def study_table(file: StudyFile, grids: Sequence[Grid], directory: Path) -> pd.DataFrame:
    """The columns of study.csv, with a row for each discretisation in the order of the file; see `run_study`."""
    compared = [f"{file.quantity}@{place:g}" for place in file.at] or [file.quantity]
    rows = []
    for case, count in zip(grids[0].cases, file.repeats, strict=True):
        folders = [directory / f"sweep-{i + 1}" / case.folder for i in range(count)]
        rows.append(case.parameters | _measured(folders, file, compared))
    table = pd.DataFrame(rows, columns=[*grids[0].varying, *MEASURED, *compared])
    values = table[compared].astype(float)
    whole = values.notna().all(axis=1)
    reference: Any = None if file.exact is not None else file.reference
    if reference == "finest":
        by_size = table[whole].fillna({"steps": 0}).sort_values(["unknowns", "steps"])
        reference = by_size.index[-1] if len(by_size) else None
    table["reference"] = table.index == reference
    exact = values.loc[reference].tolist() if reference is not None else file.exact
    table["error"] = (values[whole & ~table["reference"]] - exact).abs().max(axis=1)
    table["relative_error"] = table["error"] / (np.abs(exact or [0.0]).max() or np.nan)
    for family in FAMILIES:
        for group in families(table[whole], family):
            table.loc[group.index, f"order_{family}"] = group["order"]
    return table


def _measured(folders: Sequence[Path], file: StudyFile, compared: Sequence[str]) -> dict[str, Any]:
    """Status, counts, times and compared values of a discretisation, once all its repetitions have finished."""
    records = [read_record(folder) for folder in folders]
    record = next((each for each in records if each.get("status") != "finished"), records[0])
    row = {name: record.get(name) for name in ("reason", *COUNTS)} | {"status": record.get("status", "pending")}
    if row["status"] != "finished":
        return row
    times = [each["wall_time"] for each in records]
    row |= {"wall_time": np.median(times), "wall_time_spread": max(times) - min(times)}
    series = read_table(folders[0] / f"{QUESTIONS[file.command].tables[0]}.csv")
    axis = next(iter(series.values()))
    at = np.array(file.at or axis[-1:])
    nearest = np.abs(axis[:, None] - at).argmin(axis=0)
    reached = np.allclose(axis[nearest], at, rtol=SAME, atol=SAME)
    return row | (dict(zip(compared, series[file.quantity][nearest], strict=True)) if reached else {})


def settings_of(columns: Iterable[Any]) -> list[str]:
    """The columns of study.csv that are keys of the cases."""
    return list(takewhile(lambda name: name != "status", columns))


def families(table: pd.DataFrame, family: str) -> Iterator[pd.DataFrame]:
    """Rows of study.csv that differ in keys of a family only, the coarsest first, with `order`, from row to row.

    Fixed and controlled steps have different errors and are apart.
    """
    h = table["unknowns"].astype(float) ** -0.5 if family == "space" else 1 / table["steps"].astype(float)
    fixed = table["time.fixed_step"].notna() if "time.fixed_step" in table else False
    sized = table.assign(h=h, fixed=fixed).dropna(subset="h").sort_values("h", ascending=False, kind="stable")
    others = [key for key in settings_of(table) if not key.startswith(FAMILIES[family])]
    for _, group in sized.groupby([str(row) for row in sized[[*others, "fixed"]].to_numpy().tolist()]):
        ratios = group[["error", "h"]].shift() / group[["error", "h"]]
        order = np.log(ratios["error"]) / np.log(ratios["h"])
        yield group.assign(order=order.where(np.isfinite(order)))

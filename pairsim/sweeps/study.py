"""`pairsim study`: error and wall time of one case in several discretisations.

Each discretisation is a case of a sweep, and each repetition a sweep of its own, in the folders sweep-1, sweep-2, ...
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pairsim.cases.identity import RUNS
from pairsim.cases.mistakes import Mistake, input_error
from pairsim.cases.yaml_file import read_yaml
from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import parse_file
from pairsim.computing.many_cases import StudyFile, check_study
from pairsim.results.columns import series_columns
from pairsim.results.folder import read_record, write_text
from pairsim.results.table_files import read_table, table_text
from pairsim.sweeps.grid import Grid, grid_from
from pairsim.sweeps.sweep import INTERRUPTED, Options, Workers, run_sweep, with_workers

TABLE = "study.csv"
FAMILIES = {"space": "mesh.", "time": "time."}
"""Discretisations that differ only in keys with one of these prefixes form a family, for which orders are computed."""
COUNTS = ("unknowns", "steps", "newton_iterations", "factorisations")
MEASURED = ("status", "reason", *COUNTS, "wall_time", "wall_time_spread")
SAME = 1e-9  # relative tolerance at which two times or distances count as equal


def read_study(path: Path, settings: Sequence[str] = ()) -> tuple[StudyFile, list[Grid]]:
    """Read a study file; returns its keys, and a grid for each repetition, the first one with all discretisations.

    Raises:
        InputError: The file or a case has mistakes; lists file, entry, key, value and what is allowed.
    """
    data = read_yaml(path)
    file = parse_file("study", StudyFile, check_study, data, str(path))
    at = {"d" if file.command == "curve" else "output.times": file.places} if file.places else {}
    cases = [{key: value for key, value in entry.items() if key != "repeat"} | at for entry in data["discretisations"]]
    shared = {key: data[key] for key in ("name", "base", "command") if key in data}
    grid = grid_from(path, shared | {"cases": cases}, settings, "discretisations")
    wrong, known = [], series_columns(grid.cases[0].case.n)[1:]
    if file.quantity not in known:
        wrong.append(Mistake("quantity", file.quantity, f"must be one of {', '.join(known)}"))
    if grid.duplicates:
        allowed = f"must all differ; {grid.duplicates} are equal to an earlier one"
        wrong.append(Mistake("discretisations", None, allowed))
    if wrong:
        raise input_error(wrong, data, str(path))
    counted = list(zip(grid.cases, file.repeats, strict=True))
    repeated = (tuple(case for case, count in counted if count > i) for i in range(max(file.repeats)))
    return file, [replace(grid, cases=each) for each in repeated]


def compute_study(
    path: Path, folder: Path | None, options: Options, settings: Sequence[str] = ()
) -> tuple[int, str, Path]:
    """Compute the cases of a study that are not finished yet, and write study.csv and study.png into its folder.

    Args:
        path: The study file.
        folder: Folder of the study; made, or continued if it exists. None: runs/<name of the study>.
        options: How its sweeps are computed.
        settings: key=value settings that replace keys in every case.

    Returns:
        Exit code and message of the sweep that has ended worst, and the folder.

    Raises:
        InputError: The study is invalid, the folder belongs to another one, or another command is writing to it.
    """

    def compute(workers: Workers) -> tuple[int, str, Path]:
        from pairsim.sweeps.study_plots import plot_study

        file, grids = read_study(path, settings)
        directory = folder or RUNS / grids[0].name
        done: list[tuple[int, str]] = []
        for i, grid in enumerate(grids):
            done.append(run_sweep(grid, directory / f"sweep-{i + 1}", options, workers))
            if done[-1][0] == INTERRUPTED:
                break
        table = study_table(file, grids, directory).dropna(axis="columns", how="all").convert_dtypes()
        rows = table.astype(object).where(table.notna(), None).to_numpy().tolist()
        write_text(directory / TABLE, table_text(list(table.columns), rows))
        plot_study(directory)
        return *max(done, key=lambda each: each[0]), directory

    return with_workers(compute)


def study_table(file: StudyFile, grids: Sequence[Grid], directory: Path) -> pd.DataFrame:
    """The columns of study.csv, with a row for each discretisation in the order of the file."""
    compared = [f"{file.quantity}@{place:g}" for place in file.places] or [file.quantity]
    rows = []
    for case, count in zip(grids[0].cases, file.repeats, strict=True):
        folders = [directory / f"sweep-{i + 1}" / case.folder for i in range(count)]
        rows.append({**case.parameters, **_measured(folders, file, compared)})
    table = pd.DataFrame(rows, columns=[*grids[0].varying, *MEASURED, *compared])
    values = table[compared].astype(float)
    whole = values.notna().all(axis=1)
    reference: Any = file.reference
    if reference == "finest":
        by_size = table[whole].fillna({"steps": 0}).sort_values(["unknowns", "steps"])
        reference = by_size.index[-1] if len(by_size) else None
    table["reference"] = table.index == reference
    exact = values.loc[reference] if reference is not None else values.max() * np.nan
    table["error"] = (values[whole & ~table["reference"]] - exact).abs().max(axis=1)
    table["relative_error"] = table["error"] / (exact.abs().max() or np.nan)
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
    series = read_table(folders[0] / f"{QUESTIONS[file.command].table}.csv")
    axis = next(iter(series.values()))
    at = np.array(file.places or axis[-1:])
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

"""`pairsim study`: compare error and cost of one case in many discretisations.

The discretisations are the cases of sweeps; this module makes study.csv from the results of these sweeps.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, suppress
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import CubicSpline

from pairsim.commands import COMMANDS
from pairsim.drivers.progress import Reporter
from pairsim.inputs.many_cases import ZERO
from pairsim.results.columns import suffixes_in
from pairsim.results.folders import read_record
from pairsim.results.output import write_text
from pairsim.results.table_files import read_table, table_text
from pairsim.runtime.arrays import Array
from pairsim.runtime.collective import collectively
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import command_line, sole_writer
from pairsim.solvers.curves.convergence import extrapolated, observed_order, pareto
from pairsim.sweeps.case import SweepCase
from pairsim.sweeps.ledger import FAILED, read_sweep
from pairsim.sweeps.options import Options
from pairsim.sweeps.study_file import TABLE, Study, columns
from pairsim.sweeps.sweep import run_sweep

if TYPE_CHECKING:
    from mpi4py import MPI

Row = dict[str, Any]
FAMILIES = {"space": "mesh.", "time": "time."}
"""Discretisations that differ only in keys with one of these prefixes form a family, for which orders are computed."""
COUNTS = ("unknowns", "steps", "points", "newton_iterations", "factorisations", "remeshings", "meshes")
FIRST = ("status", "reason", *COUNTS, "wall_time", "wall_time_spread")
LAST = (
    *("error", "relative_error", "reference"),
    *(f"{name}_{family}" for family in FAMILIES for name in ("order", "richardson", "richardson_order")),
    "pareto",
)
"""The first and last columns of study.csv, after the settings and after what was measured."""
STOPPED = 130
SAME = 1e-9  # relative tolerance at which two times or distances count as equal


def study_rows(study: Study, folders: list[Path]) -> list[Row]:
    """The rows of study.csv.

    Args:
        study: The study.
        folders: Its folders, one for each repetition.

    Returns:
        A row for each discretisation in the order of the file, with the values known so far.
    """
    sweeps = {command: [sweep_folder(study, folder, command) for folder in folders] for command in study.grids}
    noted = {command: [_noted(sweep) for sweep in found] for command, found in sweeps.items()}
    rows = []
    for command, case in study.cases:
        found = zip(sweeps[command], noted[command], strict=True)
        repetitions = [_repetition(study, command, case, sweep, notes) for sweep, notes in found]
        rows.append(study.settings(command, case) | _together(repetitions))
    whole = [row for row in rows if all(name in row for name in study.compared)]
    _errors(study, rows, whole)
    for family, beginning in FAMILIES.items():
        _orders(study, family, beginning, [row for row in whole if family == "space" or row.get("steps")])
    known = [row for row in rows if "error" in row]
    front = pareto([row["wall_time"] for row in known], [row["error"] for row in known])
    for row in rows:
        row["pareto"] = any(row is known[i] for i in front)
    return rows


def sweep_folder(study: Study, folder: Path, command: str) -> Path:
    """Folder of the sweep of one command within a repetition."""
    return folder if len(study.grids) == 1 else folder.with_name(f"{folder.name}-{command}")


def _noted(directory: Path) -> dict[str, Row]:
    """The entries of sweep.json by folder of the case; empty before the sweep has begun."""
    with suppress(InputError):
        return {case["folder"]: case for case in read_sweep(directory)["cases"]}
    return {}


def _repetition(study: Study, command: str, case: SweepCase, sweep: Path, noted: dict[str, Row]) -> Row:
    """The values of one discretisation from its folder in the sweep of a repetition."""
    directory, note = sweep / case.folder, noted.get(case.folder, {})
    record = read_record(directory)
    standing = note if note.get("status") in FAILED else record  # crashes and timeouts are recorded by the sweep only
    row: Row = {"status": standing.get("status", "pending"), "reason": standing.get("reason", "")}
    if row["status"] == "finished" or record.get("status") == "failed":
        row |= {name: record[name] for name in COUNTS if name in record}
    if row["status"] != "finished" or "unknowns" not in record:
        return row
    row["wall_time"] = float(record["wall_time"])
    row |= {f"wall_{name}": seconds for name, seconds in record.get("wall_time_by_phase", {}).items()}
    row["peak_memory"] = record["peak_memory"]
    read = sampled(read_table(directory / f"{COMMANDS[command].tables[0]}.csv"), study.over, study.at)
    if read is None:
        return row
    row |= {f"{study.column}@{place:g}": float(read[study.column][i]) for i, place in enumerate(study.at)}
    names = [name for name in columns(case) if name.startswith(("dU", "D_"))]
    row |= {name: float(read[name][-1]) for name in (*names, study.column)}
    zeros = read_table(directory / "equilibria.csv", missing_ok=True)
    if len(zeros.get("d", ())):
        row[ZERO] = float(zeros["d"][zeros["peak"].argmax()])
    return row


def _together(repetitions: Sequence[Row]) -> Row:
    """The row of all repetitions of a discretisation; only status, reason and counts if one of them failed."""
    ill = [row for row in repetitions if row["status"] in FAILED]
    done = [row for row in repetitions if "wall_time" in row]
    if ill or not done:
        return {name: value for name, value in (ill or repetitions)[0].items() if name in FIRST[:-2]}
    walls = [row["wall_time"] for row in done]
    phases = dict.fromkeys(name for row in done for name in row if name.startswith("wall_"))
    medians = {name: median(row.get(name, 0.0) for row in done) for name in phases}
    memory = max(row["peak_memory"] for row in done)
    return done[0] | medians | {"wall_time_spread": max(walls) - min(walls), "peak_memory": memory}


def _errors(study: Study, rows: list[Row], whole: list[Row]) -> None:
    """Add the differences from the exact values, or from the reference, to the rows that have what is compared."""
    reference: Row | None = None
    if study.exact is None and study.reference is not None:
        reference = rows[study.reference]
    elif study.exact is None and whole:
        reference = max(whole, key=lambda row: (row["unknowns"], row.get("steps", 0)))
    for row in rows:
        row["reference"] = row is reference
    exact = study.exact or next((study.values(row) for row in whole if row is reference), None)
    for row in whole:
        if exact is not None and row is not reference:
            row["error"] = max(abs(a - b) for a, b in zip(study.values(row), exact, strict=True))
            if largest := max(map(abs, exact)):
                row["relative_error"] = row["error"] / largest


def _orders(study: Study, family: str, beginning: str, rows: list[Row]) -> None:
    """Add observed orders and Richardson extrapolations of rows that differ only in space or only in time.

    The mesh size is taken as 1/sqrt(unknowns), the step size as 1/steps.
    """
    groups: dict[str, list[tuple[float, Row]]] = {}
    for row in rows:
        rest = [row[key] for key in study.varying if not key.startswith(beginning)]
        fixed = row.get("time.fixed_step") is not None  # fixed and controlled steps have different errors
        h = row["unknowns"] ** -0.5 if family == "space" else 1 / row["steps"]
        groups.setdefault(repr((rest, fixed)), []).append((h, row))
    for group in groups.values():
        group.sort(key=lambda each: -each[0])
        for (H, coarse), (h, fine) in pairwise(group):
            errors = coarse.get("error", 0.0), fine.get("error", 0.0)
            fine[f"order_{family}"] = observed_order((H, h), errors)
        for three in zip(group, group[1:], group[2:], strict=False):
            found = extrapolated([h for h, _ in three], [study.values(row)[-1] for _, row in three])
            if found is not None:
                limit, order = found
                three[-1][1].update({f"richardson_{family}": limit, f"richardson_order_{family}": order})


def sampled(series: dict[str, Array], over: str, at: tuple[float, ...]) -> dict[str, Array] | None:
    """The columns of series.csv or curve.csv at given times or distances; None if one of them is not reached.

    Args:
        series: The columns, each of shape (rows,).
        over: "t" or "d".
        at: Times [D_c/U_av] or distances [D_c]; if empty, the last row is used. A run is evaluated where it passes a
            distance for the last time, with cubic interpolation in time between its rows.

    Returns:
        The columns at these values, each of shape (len(at),), or (1,) for the last row.
    """
    if not at:
        return {name: column[-1:] for name, column in series.items()}
    axis = series["t"] if over == "t" else series[f"d{suffixes_in(series, 'd')[0]}"]
    places = []
    for place in at:
        off = axis - place
        near = int(abs(off).argmin())
        if over == "t" or "t" not in series:
            if abs(off[near]) > SAME * max(1.0, place):
                return None
            places.append({name: column[near] for name, column in series.items()})
            continue
        passed = np.flatnonzero(off[1:] * off[:-1] <= 0)
        if not len(passed):
            return None
        rows = slice(max(int(passed[-1]) - 1, 0), int(passed[-1]) + 3)
        t, roots = series["t"][rows], CubicSpline(series["t"][rows], off[rows]).roots(extrapolate=False)
        when = roots[-1] if len(roots) else series["t"][passed[-1] + 1]
        places.append({name: CubicSpline(t, column[rows])(when) for name, column in series.items()})
    return {name: np.array([place[name] for place in places]) for name in series}


def write_study(study: Study, rows: list[Row], path: Path) -> None:
    """Write study.csv, with empty cells for unknown values."""
    seen = dict.fromkeys(name for row in rows for name, value in row.items() if value is not None)
    walls = (name for name in seen if name.startswith("wall_"))
    measured = (name for name in seen if name not in LAST)
    names = dict.fromkeys((*study.varying, *FIRST, *walls, *measured, *LAST))
    header = [name for name in names if name in study.varying or name in seen]
    write_text(path, table_text(header, [[row.get(name) for name in header] for row in rows]))


def run_study(
    study: Study, directory: Path, options: Options, comm: MPI.Comm | None, reporter: Reporter
) -> tuple[int, str]:
    """Compute the cases that are not finished yet, each in its own process, and write study.csv and study.png.

    Args:
        study: The study.
        directory: Folder of the study; created, or continued if it exists.
        options: Options of its sweeps.
        comm: MPI communicator; every process of it calls this function. None: without MPI.
        reporter: Shows progress (on the first process).

    Returns:
        The largest exit code of its sweeps, and a line of text for the user, as `run_sweep`.

    Raises:
        InputError: The folder belongs to another study, or another command is writing to it.
    """
    with ExitStack() as held:
        collectively(comm, lambda: held.enter_context(sole_writer(directory, command_line())))
        folders = [directory / f"sweep-{i + 1}" for i in range(max(study.repeat))]
        worst, shown = 0, ""
        sweeps = [(folder, *sweep) for i, folder in enumerate(folders) for sweep in study.repetition(i).items()]
        for folder, command, grid in sweeps:
            code, message = run_sweep(grid, sweep_folder(study, folder, command), options, comm, reporter)
            if not shown or code > worst:
                worst, shown = code, message
            if code == STOPPED:
                break
        if comm is None or comm.rank == 0:
            from pairsim.sweeps.study_plots import plot_study

            rows = study_rows(study, folders)
            write_study(study, rows, directory / TABLE)
            plot_study(directory)
        return worst, shown

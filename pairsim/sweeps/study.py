"""`pairsim study`: compare error and cost of one case in many discretisations.

The discretisations are the cases of sweeps; this module makes study.csv from the results of these sweeps.
"""

from __future__ import annotations

import csv
import io
import json
import statistics
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import CubicSpline

from pairsim.commands import COMMANDS
from pairsim.drivers.progress import Reporter
from pairsim.inputs.many_cases import ZERO
from pairsim.results.folders import read_record
from pairsim.results.output import read_series, write_text
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import command_line, sole_writer
from pairsim.solvers.curves.convergence import extrapolated, observed_order, pareto
from pairsim.sweeps.case import SweepCase
from pairsim.sweeps.ledger import cell, read_sweep
from pairsim.sweeps.study_file import TABLE, Study, columns
from pairsim.sweeps.sweep import Options, run_sweep

if TYPE_CHECKING:
    from mpi4py import MPI

FAMILIES = {"space": "mesh.", "time": "time."}
"""Discretisations that differ only in keys with one of these prefixes form a family, for which orders are computed."""
COUNTS = ("unknowns", "steps", "points", "newton_iterations", "factorisations", "remeshings", "meshes")
STOPPED = 130
SAME = 1e-9  # relative tolerance at which two times or distances count as equal


def study_rows(study: Study, folders: list[Path]) -> list[dict[str, Any]]:
    """The rows of study.csv.

    Args:
        study: The study.
        folders: Its folders, one for each repetition.

    Returns:
        A row for each discretisation in the order of the file, with the values known so far.
    """
    notes = [{command: _notes(sweep_folder(study, folder, command)) for command in study.grids} for folder in folders]
    rows = [_row(study, command, case, folders, notes) for command, case in study.cases]
    exact = study.exact
    chosen: int | None = None
    if exact is None:
        whole = [i for i, row in enumerate(rows) if row["_values"] is not None]
        chosen = study.reference
        if chosen is None and whole:
            chosen = max(whole, key=lambda i: (rows[i]["unknowns"], rows[i].get("steps", 0)))
        exact = rows[chosen]["_values"] if chosen in whole else None
    for i, row in enumerate(rows):
        row["reference"] = i == chosen
        if exact is not None and row["_values"] is not None and i != chosen:
            row["error"] = max(abs(a - b) for a, b in zip(row["_values"], exact, strict=True))
            if largest := max(map(abs, exact)):
                row["relative_error"] = row["error"] / largest
    _families(study, rows)
    _front(rows)
    return rows


def sweep_folder(study: Study, folder: Path, command: str) -> Path:
    """Folder of the sweep of one command within a repetition."""
    return folder if len(study.grids) == 1 else folder.with_name(f"{folder.name}-{command}")


def _notes(directory: Path) -> dict[str, dict[str, Any]]:
    """The entries of sweep.json by folder of the case; empty before the sweep has begun."""
    with suppress(InputError):
        return {case["folder"]: case for case in read_sweep(directory)["cases"]}
    return {}


def _standing(record: dict[str, Any], noted: dict[str, Any]) -> tuple[str, str]:
    """Status and reason of a case; crashes and timeouts are recorded by the sweep only."""
    if noted.get("status") in ("failed", "timeout"):
        return noted["status"], noted["reason"]
    return record.get("status", "pending"), record.get("reason", "")


def _row(
    study: Study, command: str, case: SweepCase, folders: list[Path], notes: list[dict[str, dict[str, Any]]]
) -> dict[str, Any]:
    """The values of one discretisation from its folders; only status and reason if a repetition failed."""
    directories = [sweep_folder(study, folder, command) / case.folder for folder in folders]
    records = [read_record(directory) for directory in directories]
    standing = [_standing(t, note[command].get(case.folder, {})) for t, note in zip(records, notes, strict=True)]
    ill = [each for each in standing if each[0] in ("failed", "timeout")]
    done = [i for i, (status, _) in enumerate(standing) if status == "finished" and "unknowns" in records[i]]
    status, reason = ill[0] if ill else standing[done[0] if done else 0]
    row: dict[str, Any] = study.settings(command, case) | {"status": status, "reason": reason, "_values": None}
    counted = records[done[0]] if done and not ill else next((t for t in records if t.get("status") == "failed"), {})
    row |= {name: counted[name] for name in COUNTS if name in counted}
    if ill or not done:
        return row
    walls = [float(records[i]["wall_time"]) for i in done]
    row |= {"wall_time": statistics.median(walls), "wall_time_spread": max(walls) - min(walls)}
    for name in dict.fromkeys(name for i in done for name in records[i].get("wall_time_by_phase", {})):
        row[f"wall_{name}"] = statistics.median(records[i]["wall_time_by_phase"].get(name, 0.0) for i in done)
    row["peak_memory"] = max(records[i]["peak_memory"] for i in done)
    series = read_series(directories[done[0]] / f"{COMMANDS[command].tables[0]}.csv")
    read = sampled(series, study.over, study.at)
    if read is None:
        return row
    for i, place in enumerate(study.at):
        row[f"{study.column}@{place:g}"] = float(read[study.column][i])
    row |= {name: float(read[name][-1]) for name in columns(case) if name.startswith(("dU", "D_"))}
    if command == "curve" and (zero := _critical_distance(directories[done[0]])) is not None:
        row[ZERO] = zero
    if study.quantity == ZERO:
        row["_values"] = [row[ZERO]] if ZERO in row else None
    else:
        row["_values"] = [float(value) for value in read[study.quantity]]
        row[study.quantity] = row["_values"][-1]
    return row


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
    axis = series["t"] if over == "t" else series["d" if "d" in series else "d_1"]
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


def _critical_distance(directory: Path) -> float | None:
    """The zero of a curve with the largest peak [D_c], None if there is none."""
    path = directory / "equilibria.csv"
    if not path.is_file():
        return None
    with path.open(newline="") as file:
        zeros = [(float(row["peak"]), float(row["d"])) for row in csv.DictReader(file)]
    return max(zeros)[1] if zeros else None


def _families(study: Study, rows: list[dict[str, Any]]) -> None:
    """Add observed orders and Richardson extrapolations of discretisations that differ only in space or only in time.

    The mesh size is taken as 1/sqrt(unknowns), the step size as 1/steps.
    """
    for family, beginning in FAMILIES.items():
        groups: dict[str, list[dict[str, Any]]] = {}
        for row in rows:
            if row["_values"] is not None and (family == "space" or row.get("steps")):
                rest = {key: row[key] for key in study.varying if not key.startswith(beginning)}
                rest["fixed"] = (
                    row.get("time.fixed_step") is not None
                )  # fixed and controlled steps have different errors
                groups.setdefault(json.dumps(rest, sort_keys=True), []).append(row)
        for group in groups.values():
            h = {id(row): row["unknowns"] ** -0.5 if family == "space" else 1 / row["steps"] for row in group}
            group.sort(key=lambda row: -h[id(row)])
            for coarse, fine in pairwise(group):
                errors = (coarse.get("error", 0.0), fine.get("error", 0.0))
                fine[f"order_{family}"] = observed_order((h[id(coarse)], h[id(fine)]), errors)
            for three in zip(group, group[1:], group[2:], strict=False):
                found = extrapolated([h[id(row)] for row in three], [row["_values"][-1] for row in three])
                if found is not None:
                    three[-1][f"richardson_{family}"], three[-1][f"richardson_order_{family}"] = found


def _front(rows: list[dict[str, Any]]) -> None:
    """Mark the Pareto front: rows for which no other has a smaller wall time at the same or a smaller error."""
    known = [row for row in rows if row.get("error") is not None]
    front = {id(known[i]) for i in pareto([row["wall_time"] for row in known], [row["error"] for row in known])}
    for row in rows:
        row["pareto"] = id(row) in front


def write_study(study: Study, rows: list[dict[str, Any]], path: Path) -> None:
    """Write study.csv, with empty cells for unknown values."""
    first = [*study.varying, "status", "reason", *COUNTS, "wall_time", "wall_time_spread"]
    last = ["peak_memory"]
    places = [f"{study.column}@{place:g}" for place in study.at]
    last += [*places, *(name for name in columns(study.cases[0][1]) if name.startswith(("dU", "D_")))]
    last += [study.quantity, ZERO, "error", "relative_error", "reference"]
    last += [f"{name}_{family}" for family in FAMILIES for name in ("order", "richardson", "richardson_order")]
    phases = dict.fromkeys(name for row in rows for name in row if name.startswith("wall_"))
    names = list(dict.fromkeys([*first, *phases, *last, "pareto"]))
    names = [name for name in names if name in study.varying or any(row.get(name) is not None for row in rows)]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    for row in rows:
        writer.writerow([cell(row.get(name)) for name in names])
    write_text(path, text.getvalue())


def run_study(
    study: Study, directory: Path, case_timeout: float | None, comm: MPI.Comm | None, reporter: Reporter
) -> tuple[int, str]:
    """Compute the cases that are not finished yet, each in its own process, and write study.csv and study.png.

    Args:
        study: The study.
        directory: Folder of the study; created, or continued if it exists.
        case_timeout: Largest wall time of a case [s].
        comm: MPI communicator; every process of it calls this function. None: without MPI.
        reporter: Shows progress (on the first process).

    Returns:
        The largest exit code of its sweeps, and a line of text for the user, as `run_sweep`.

    Raises:
        InputError: The folder belongs to another study, or another command is writing to it.
    """
    with sole_writer(directory, command_line(), comm):
        folders = [directory / f"sweep-{i + 1}" for i in range(max(study.repeat))]
        worst, shown = 0, ""
        sweeps = [(folder, *sweep) for i, folder in enumerate(folders) for sweep in study.repetition(i).items()]
        for folder, command, grid in sweeps:
            options = Options(case_timeout=case_timeout, cold=True)
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

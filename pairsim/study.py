"""`pairsim study`: one case in many discretisations, and what each costs for its error.

The discretisations are the cases of a sweep; this module says what a study file may hold and makes study.csv of what
the sweep has left behind.
"""

from __future__ import annotations

import csv
import io
import json
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.convergence import extrapolated, order, pareto
from pairsim.errors import InputError
from pairsim.grid import Grid, SweepCase, grid_from
from pairsim.output import read_series, series_columns, write_text
from pairsim.sweep import Options, run_sweep
from pairsim.sweep_commands import read_told
from pairsim.sweep_progress import SweepReporter

if TYPE_CHECKING:
    from mpi4py import MPI

KEYS = ("name", "command", "base", "discretisations", "quantity", "at", "exact", "reference", "repeat")
FAMILIES = {"space": "mesh.", "time": "time."}
"""Discretisations that differ in keys with one of these beginnings alone are a family, and have an order."""
COUNTS = ("unknowns", "steps", "points", "newton_iterations", "factorisations", "remeshings", "meshes")
TABLE = "study.csv"
ZERO = "d_cr"
"""Quantity of a curve that is no column of it: the distance at which dU vanishes, the zero with the largest peak."""
STOPPED = 130
SAME = 1e-9  # times and distances that agree to this part are the same


@dataclass(frozen=True)
class Study:
    """A study file, read and checked.

    Attributes:
        grid: One case for each discretisation, in the order of the file.
        quantity: What is compared: a column, or d_cr.
        at: Times (run) or distances (curve) at which it is; empty: at the end of a run.
        exact: Its exact values at those, None where they are unknown.
        reference: Index of the discretisation that stands for the exact values, None: the one with the most unknowns.
        repeat: How often each is computed; times are medians.
    """

    grid: Grid
    quantity: str
    at: tuple[float, ...]
    exact: tuple[float, ...] | None
    reference: int | None
    repeat: int

    @property
    def column(self) -> str:
        """The column that is read at the places of `at`."""
        return "dU" if self.quantity == ZERO else self.quantity


def read_study(path: Path, data: dict[str, Any], settings: tuple[str, ...] = ()) -> Study:
    """Check the content of a study file.

    Args:
        path: Where it stands.
        data: Its content.
        settings: key=value settings that replace a key in every case.

    Raises:
        InputError: With the file, the key, its value and what is allowed.
    """

    def refuse(key: str, value: Any, allowed: str) -> None:
        raise InputError(str(path), key, value, allowed)

    for key in data:
        if key not in KEYS:
            refuse(key, data[key], f"unknown key; allowed: {', '.join(KEYS)}")
    command, entries = data.get("command", "run"), data.get("discretisations")
    if command not in ("run", "curve"):
        refuse("command", command, "run or curve")
    if not isinstance(entries, list) or len(entries) < 2:
        refuse("discretisations", entries, "a list of two or more, such as - {mesh.Np: 20, time.tol: 1e-4}")
    assert isinstance(entries, list)
    at = _numbers(data.get("at", []), "at", "a number above 0, or a list of them", refuse)
    if any(place <= 0 for place in at):
        refuse("at", data["at"], "above 0")
    if command == "curve" and not at:
        refuse("at", None, "is missing; the distances at which the curve is compared")
    quantity = data.get("quantity", "dU")
    count = 1 if quantity == ZERO else max(len(at), 1)
    exact = None
    if "exact" in data:
        wanted_count = f"{count} number{'s, one for each of at' if count > 1 else ''}"
        exact = _numbers(data["exact"], "exact", wanted_count, refuse)
        if len(exact) != count:
            refuse("exact", data["exact"], wanted_count)
    reference = data.get("reference", "finest")
    if "exact" in data and "reference" in data:
        refuse("reference", reference, "nothing, beside exact")
    if reference != "finest" and not (type(reference) is int and 0 <= reference < len(entries)):
        refuse("reference", reference, f"finest, or the index of a discretisation from 0 to {len(entries) - 1}")
    repeat = data.get("repeat", 1)
    if type(repeat) is not int or not 1 <= repeat <= 100:
        refuse("repeat", repeat, "a whole number from 1 to 100")
    wanted = {"d": list(at)} if command == "curve" else {"output.times": list(at)} if at else {}
    taken = [key for entry in entries if isinstance(entry, dict) for key in wanted if key in entry]
    if taken:
        refuse(f"discretisations: {taken[0]}", None, "nothing: at says it")
    content: dict[str, Any] = {key: data[key] for key in ("name", "base") if key in data}
    cases = [{**wanted, **entry} if isinstance(entry, dict) else entry for entry in entries]
    grid = grid_from(path, {**content, "command": command, "cases": cases}, settings)
    if grid.duplicates:
        refuse("discretisations", None, f"all different; {grid.duplicates} are like an earlier one")
    allowed = sorted({name for case in grid.cases for name in _columns(case)})
    allowed += [ZERO] if command == "curve" else []
    if quantity not in allowed:
        refuse("quantity", quantity, f"one of {', '.join(allowed)}")
    return Study(grid, quantity, at, exact, None if reference == "finest" else reference, repeat)


def _numbers(value: Any, key: str, allowed: str, refuse: Callable[[str, Any, str], None]) -> tuple[float, ...]:
    values = value if isinstance(value, list) else [value]
    if any(isinstance(each, bool) or not isinstance(each, int | float) for each in values):
        refuse(key, value, allowed)
    return tuple(map(float, values))


def _columns(case: SweepCase) -> list[str]:
    """Columns of the results of a case that can be compared."""
    return series_columns(case.checked.resolved.get("particles", 2))[1:]


def study_rows(study: Study, folders: list[Path]) -> list[dict[str, Any]]:
    """What is told of every discretisation.

    Args:
        study: The study.
        folders: Folders of its sweeps, one a repetition.

    Returns:
        A row for each in the order of the file, with everything that is known so far.
    """
    rows = [_row(study, case, folders) for case in study.grid.cases]
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


def _row(study: Study, case: SweepCase, folders: list[Path]) -> dict[str, Any]:
    """What one discretisation has left in its folders."""
    told = [read_told(folder / case.folder) for folder in folders]
    done = [each for each in told if each.get("status") == "finished"]
    row: dict[str, Any] = {key: case.parameters.get(key) for key in study.grid.varying}
    row |= {"status": told[0].get("status", "pending"), "reason": told[0].get("reason", ""), "_values": None}
    row |= {name: told[0][name] for name in COUNTS if name in told[0]}
    if not done:
        return row
    walls = [float(each["wall_time"]) for each in done]
    row |= {"wall_time": statistics.median(walls), "wall_time_spread": max(walls) - min(walls)}
    phases = dict.fromkeys(name for each in done for name in each.get("wall_time_by_phase", {}))
    for name in phases:
        row[f"wall_{name}"] = statistics.median(each["wall_time_by_phase"].get(name, 0.0) for each in done)
    row["peak_memory"] = max(each["peak_memory"] for each in done)
    directory = folders[told.index(done[0])] / case.folder
    curve = study.grid.command.name == "curve"
    series = read_series(directory / ("curve.csv" if curve else "series.csv"))
    axis = next(name for name in ("d", "d_1", "t") if name in series and (curve or name == "t"))
    values, last = [], 0
    for place in study.at or (float(series[axis][-1]),):
        near = int(abs(series[axis] - place).argmin())
        if abs(series[axis][near] - place) <= SAME * max(1.0, place):
            values.append(float(series[study.column][near]))
            last = near
    if len(values) != max(len(study.at), 1):
        return row
    for place, value in zip(study.at, values, strict=False):
        row[f"{study.column}@{place:g}"] = value
    row |= {name: float(series[name][last]) for name in _columns(case) if name.startswith(("dU", "D_"))}
    if curve and (zero := _critical_distance(directory)) is not None:
        row[ZERO] = zero
    if study.quantity == ZERO:
        row["_values"] = [row[ZERO]] if ZERO in row else None
    else:
        row["_values"], row[study.quantity] = values, values[-1]
    return row


def _critical_distance(directory: Path) -> float | None:
    """The zero of a curve with the largest peak."""
    path = directory / "equilibria.csv"
    if not path.is_file():
        return None
    with path.open(newline="") as file:
        zeros = [(float(row["peak"]), float(row["d"])) for row in csv.DictReader(file)]
    return max(zeros)[1] if zeros else None


def _families(study: Study, rows: list[dict[str, Any]]) -> None:
    """Orders and Richardson's estimates among discretisations that differ in space alone, or in time alone.

    The size that an order is over is 1/sqrt(unknowns) in space and 1/steps in time.
    """
    for family, beginning in FAMILIES.items():
        if family == "time" and study.grid.command.name == "curve":
            continue
        groups: dict[str, list[dict[str, Any]]] = {}
        for row in rows:
            if row["_values"] is not None:
                rest = {key: row[key] for key in study.grid.varying if not key.startswith(beginning)}
                rest["fixed"] = row.get("time.fixed_step") is not None  # whose errors are of another kind
                groups.setdefault(json.dumps(rest, sort_keys=True), []).append(row)
        for group in groups.values():
            h = {id(row): row["unknowns"] ** -0.5 if family == "space" else 1 / row["steps"] for row in group}
            group.sort(key=lambda row: -h[id(row)])
            for coarse, fine in pairwise(group):
                errors = (coarse.get("error", 0.0), fine.get("error", 0.0))
                fine[f"order_{family}"] = order((h[id(coarse)], h[id(fine)]), errors)
            for three in zip(group, group[1:], group[2:], strict=False):
                found = extrapolated([h[id(row)] for row in three], [row["_values"][-1] for row in three])
                if found is not None:
                    three[-1][f"richardson_{family}"], three[-1][f"richardson_order_{family}"] = found


def _front(rows: list[dict[str, Any]]) -> None:
    """Mark the rows that no other beats in time without a larger error."""
    told = [row for row in rows if row.get("error") is not None]
    front = {id(told[i]) for i in pareto([row["wall_time"] for row in told], [row["error"] for row in told])}
    for row in rows:
        row["pareto"] = id(row) in front


def write_study(study: Study, rows: list[dict[str, Any]], path: Path) -> None:
    """Write study.csv; empty cells where nothing is known."""
    first = [*study.grid.varying, "status", "reason", *COUNTS, "wall_time", "wall_time_spread"]
    last = ["peak_memory"]
    places = [f"{study.column}@{place:g}" for place in study.at]
    last += [*places, *(name for name in _columns(study.grid.cases[0]) if name.startswith(("dU", "D_")))]
    last += [study.quantity, ZERO, "error", "relative_error", "reference"]
    last += [f"{name}_{family}" for family in FAMILIES for name in ("order", "richardson", "richardson_order")]
    phases = dict.fromkeys(name for row in rows for name in row if name.startswith("wall_"))
    names = list(dict.fromkeys([*first, *phases, *last, "pareto"]))
    names = [name for name in names if name in study.grid.varying or any(row.get(name) is not None for row in rows)]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    for row in rows:
        writer.writerow([_cell(row.get(name)) for name in names])
    write_text(path, text.getvalue())


def _cell(value: Any) -> Any:
    """Lists, groups and truths as JSON; numbers so that reading them gives the same double."""
    if isinstance(value, list | dict | bool):
        return json.dumps(value)
    return repr(value) if isinstance(value, float) else value


def run_study(
    study: Study, directory: Path, case_timeout: float | None, comm: MPI.Comm | None, reporter: SweepReporter
) -> tuple[int, str]:
    """Compute what is not finished yet, each case from the beginning and in a process of its own; write and draw.

    Args:
        study: The study.
        directory: Its folder; made, or continued.
        case_timeout: Allowed wall time of a case in seconds.
        comm: Communicator of the job; every process calls this. None: no MPI.
        reporter: Shows progress (on the first process).

    Returns:
        Exit code and a line for people, as `pairsim.sweep.run_sweep`.

    Raises:
        InputError: A folder belongs to another study, or is in use.
    """
    folders = [directory / f"sweep-{i + 1}" for i in range(study.repeat)]
    for folder in folders:
        options = Options(case_timeout=case_timeout, cold=True)
        code, message = run_sweep(study.grid, folder, options, comm, reporter)
        if code == STOPPED:
            break
    if comm is None or comm.rank == 0:
        from pairsim.study_plots import plot_study

        rows = study_rows(study, folders)
        write_study(study, rows, directory / TABLE)
        plot_study(directory)
    return code, message

"""The commands that a sweep can run for each case, listed in `COMMANDS`.

Each entry defines how keys are validated, the estimated cost, and the columns of results.csv. The rest of the sweep
does not depend on which command it runs.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pairsim.config.case import Case, SceneCase
from pairsim.config.case_file import case_from_dict, critical_from_dict, curve_from_dict
from pairsim.config.cost import Estimate, critical_estimate, curve_estimate, run_estimate
from pairsim.config.curve_case import CriticalCase, CurveCase
from pairsim.config.form_kinds import forms_of
from pairsim.config.identity import identity_of
from pairsim.results.columns import FORCES, gap_endings, relative_velocities
from pairsim.results.folders import read_record
from pairsim.runtime.errors import InputError

Value = float | int | str | list[float] | list[bool] | None


@dataclass(frozen=True)
class Checked:
    """A validated case of any command.

    Attributes:
        slug: Beginning of its folder's name.
        resolved: The case with every default, as written to its case file.
        identity: The part of `resolved` that makes two cases the same.
        estimate: Estimated cost.
        forms: Names in the form cache of the compiled forms that it needs.
        columns: Columns of its results in results.csv.
    """

    slug: str
    resolved: dict[str, Any]
    identity: dict[str, Any]
    estimate: Estimate
    forms: tuple[str, ...]
    columns: tuple[str, ...]


@dataclass(frozen=True)
class SweepCommand[C: SceneCase]:
    """A command that a sweep can run.

    Attributes:
        name: The command's name; a case runs as `pairsim NAME CASE.yaml -o DIR --overwrite -q`.
        parse: Validates keys and values; takes them with the names of the file and the entry for messages.
        estimate: Estimates the cost of a case.
        parameters: Keys that results.csv always has, also if they do not vary.
        columns: Columns of the results of a case.
        last: Last columns of results.csv, taken from run.json.
        read: Reads the values of `columns` from a folder; values that are missing are left out, without an error.
        resumable: Whether the command can continue from checkpoint.npz with --resume.
        neighbours: Keys along which a case can start from the solutions of the previous one (see `case_worker`).
    """

    name: str
    parse: Callable[[Mapping[str, Any], str, str], C]
    estimate: Callable[[C], Estimate]
    parameters: tuple[str, ...]
    columns: Callable[[C], tuple[str, ...]]
    last: tuple[str, ...]
    read: Callable[[Path], dict[str, Value]]
    resumable: bool = False
    neighbours: tuple[str, ...] = ()

    def check(self, data: Mapping[str, Any], source: str, entry: str = "") -> Checked:
        """Validate keys and values.

        Args:
            data: Keys and values, groups nested.
            source: Name of the file in messages.
            entry: Name of the entry of the file in messages.

        Raises:
            InputError: The case has mistakes.
        """
        case = self.parse(data, source, entry)
        return Checked(
            case.slug, case.resolved(), identity_of(case), self.estimate(case), forms_of(case), self.columns(case)
        )

    def values(self, directory: Path) -> dict[str, Value]:
        """Values of a folder for the columns of results.csv."""
        record = read_record(directory)
        return self.read(directory) | {key: record.get(key) for key in self.last}


def run_result_columns(case: Case) -> tuple[str, ...]:
    """Result columns of a run: those of the last row of series.csv."""
    if case.n == 2:
        return ("t", "d", "dU", "U_L", "U_T", "D_L", "D_T", "dp")
    gaps, particles = gap_endings(case.n), range(1, case.n + 1)
    names = ["t", *(f"d{gap}" for gap in gaps), *(f"dU{gap}" for gap in gaps)]
    return (*names, *(f"U_{i}" for i in particles), *(f"D_{i}" for i in particles), "dp")


def read_run(directory: Path) -> dict[str, Value]:
    """Read the last complete row of series.csv; empty if there is none.

    Only the end of the file is read, since a continued sweep reads thousands of these files.
    """
    try:
        with (directory / "series.csv").open("rb") as file:
            header = file.readline().decode().strip().split(",")
            start = file.tell()
            file.seek(0, 2)
            file.seek(max(start, file.tell() - 65536))
            text = file.read().decode()
        lines = text[: text.rfind("\n") + 1].splitlines()
        return dict(zip(header, map(float, lines[-1].split(",")), strict=True)) if lines else {}
    except (OSError, ValueError):
        return {}


FORCE = [f"{name}_1" for name in FORCES]  # columns of the only point of a single particle that is moved


def curve_result_columns(case: CurveCase) -> tuple[str, ...]:
    """Points, zeros, and by gap the largest |dU| with its distance and errors; the force on a single moved particle."""
    names = ["d_peak{}", "d_peak_error{}", "dU_peak{}", "dU_error{}", *(["mesh_error{}"] if case.mesh_error else [])]
    others = (
        ["zeros", "zeros_error", "stable"]
        if case.n == 2
        else FORCE
        if case.n == 1 and case.velocity is not None
        else []
    )
    return ("points", *others, *(name.format(gap) for gap in gap_endings(case.n) for name in names))


def read_curve(directory: Path) -> dict[str, Value]:
    """Read the result columns of a curve; `zeros` and what belongs to them are lists in ascending d."""
    from pairsim.results.curve_table import peak_of
    from pairsim.results.output import read_series

    values: dict[str, Value] = {}
    try:
        table = read_series(directory / "curve.csv")
        values["points"] = points = len(next(iter(table.values())))
        if not points:
            return values
        values |= {name: float(table[name][0]) for name in FORCE if name in table}
        for name in relative_velocities(table):
            gap = name.removeprefix("dU")
            peak = peak_of(table, gap)
            found = {"d_peak": peak.d, "d_peak_error": peak.d_error, "dU_peak": peak.dU, "dU_error": peak.error}
            if f"mesh_error{gap}" in table:
                found["mesh_error"] = float(table[f"mesh_error{gap}"][abs(table[f"d{gap}"] - peak.d).argmin()])
            values |= {column + gap: value for column, value in found.items()}
        zeros = _rows(directory / "equilibria.csv")
        values["zeros"] = [float(row["d"]) for row in zeros]
        values["zeros_error"] = [float(row["d_error"]) for row in zeros]
        values["stable"] = [row["stable"] == "true" for row in zeros]
    except (InputError, OSError, ValueError, KeyError):  # the case failed before the files were complete
        pass
    return values


def critical_result_columns(case: CriticalCase) -> tuple[str, ...]:
    """Result columns of critical distances: number of rows, and the distances at the requested parameters."""
    return ("points", "zeros", "stable")


def read_critical(directory: Path) -> dict[str, Value]:
    """Read the result columns of critical distances; JSON lists in the order of critical.csv."""
    try:
        points = _rows(directory / "critical.csv")
        wanted = [row for row in points if row["kind"] == "wanted"]
        return {
            "points": len(points),
            "zeros": [float(row["d_cr"]) for row in wanted],
            "stable": [row["stable"] == "true" for row in wanted],
        }
    except (OSError, ValueError, KeyError):
        return {}


def _rows(table: Path) -> list[dict[str, str]]:
    with table.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


SCENE = ("beta", "De", "Ca_e")
RUN = SweepCommand(
    "run",
    case_from_dict,
    run_estimate,
    (*SCENE, "d0"),
    run_result_columns,
    ("steps", "unknowns", "wall_time"),
    read_run,
    resumable=True,
)
OTHERS = ("unknowns", "wall_time")
CURVE = SweepCommand(
    "curve",
    curve_from_dict,
    curve_estimate,
    SCENE,
    curve_result_columns,
    OTHERS,
    read_curve,
    neighbours=("De", "Ca_e"),
)
CRITICAL = SweepCommand(
    "critical", critical_from_dict, critical_estimate, SCENE, critical_result_columns, OTHERS, read_critical
)
COMMANDS: dict[str, SweepCommand[Any]] = {command.name: command for command in (RUN, CURVE, CRITICAL)}
"""The commands by name."""

"""Folders of results, made by hand: what tests of pictures and reports read."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pairsim.analysis.master_curve import Curve
from pairsim.analysis.zeros import Zero
from pairsim.record.column import names_of, table_row
from pairsim.record.columns import DISTANCE, DP, DP_PLUS, DT, DU, STATE_COLUMNS, TAYLOR, T, U, Z
from pairsim.record.record import Record
from pairsim.record.table_files import TableWriter, table_text
from pairsim.record.xdmf import FieldFrame, FieldsWriter


def make_run(folder: Path, n: int, frames: list[FieldFrame], rows: int = 12) -> Path:
    """A run of `n` particles with these fields and so many steps."""
    folder.mkdir()
    case = {"name": "sample", "particles": n, "beta": 0.4, "De": 0, "Ca_e": [0.1] * n, "d0": 0.1}
    (folder / "case.yaml").write_text(yaml.safe_dump(case))
    (folder / "run.json").write_text('{"kind": "run"}')
    series = TableWriter(folder / "series.csv", names_of(n, *STATE_COLUMNS, DT))
    for t in np.linspace(0.1, 1, rows):
        gaps, order = np.full(max(n - 1, 0), 0.1 + 0.1 * t), np.arange(n)
        velocities = 1.5 + 0.01 * order * t
        values = {T: t, DISTANCE: gaps, U: velocities, DU: np.diff(velocities), TAYLOR: 0.01 * t * (order + 1)}
        values |= {DP: 640.0, DP_PLUS: 2.0, Z: 0.5 * order + velocities * t, DT: 0.1}
        series.row(table_row(n, values))
    writer = FieldsWriter(folder)
    for frame in frames:
        writer.write(frame)
    return folder


def curve_table(d: np.ndarray, dU: np.ndarray, slope: np.ndarray, **more: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of curve.csv of a pair without errors and without memory; `more` replaces some of them."""
    one = np.ones_like(d)
    table = {"d": d, "dU": dU, "dU_held": dU, "dU_error": 0 * one, "stretch": one, "t_relax": np.nan * one}
    return table | {"slope": slope} | more | {"dU_discrete": more.get("dU_held", dU)}


def curve_of(
    table: Mapping[str, np.ndarray], zeros: Sequence[Zero] | None = (), record: Mapping[str, Any] | None = None
) -> Curve:
    """The curve of columns of curve.csv with known zeros (None: those of the interpolant) and entries of run.json."""
    known = None
    if zeros is not None:
        errors = [np.nan if zero.error is None else zero.error for zero in zeros]
        listed = [zero.d for zero in zeros], [zero.stable for zero in zeros], errors
        known = dict(zip(("d", "stable", "d_error"), map(np.array, listed), strict=True))
    return Curve(table, known, Record(record or {}), "test")


def make_curve(folder: Path, Ca_e: float, De: float = 0.5) -> Path:
    """A curve with an unstable zero at d = 0.2 and an error of 1e-3."""
    folder.mkdir(parents=True)
    d = np.array([0.05, 0.1, 0.2, 0.4, 0.6])
    table = curve_table(d, Ca_e * np.log(d / 0.2), Ca_e / d, dU_error=np.full(5, 1e-3), D_L=d / 9, D_T=-d / 9)
    (folder / "curve.csv").write_text(table_text(list(table), zip(*table.values(), strict=True)))
    (folder / "run.json").write_text('{"kind": "curve"}')
    (folder / "equilibria.csv").write_text("d,stable,slope,peak\n0.2,false,0.5,1\n")
    case = {"beta": 0.4, "De": De, "Ca_e": Ca_e, "particles": 2, "d": d.tolist()}
    case |= {"liquid": {"law": "giesekus", "alpha": 0.2}, "xi": 0.09} if De else {}
    (folder / "case.yaml").write_text(yaml.safe_dump(case | {"mesh": {"Np": 8 if De else 10}}))
    return folder


def make_sweep(
    folder: Path, command: str, parameters: Mapping[str, Mapping[str, Any]], varying: list[str], **more: object
) -> Path:
    """A sweep of cases whose folders are there, or are not begun.

    Args:
        folder: The folder.
        command: The command.
        parameters: Those of each case, by its folder.
        varying: The keys that vary.
        more: Further entries of sweep.json.
    """
    folder.mkdir(exist_ok=True)
    cases = [{"folder": name, "key": name, "parameters": values} for name, values in parameters.items()]
    for name in parameters:
        if (path := folder / name / "run.json").is_file():
            path.write_text(json.dumps({"kind": command, **json.loads(path.read_text()), "key": name}))
    keys = list(dict.fromkeys(key for values in parameters.values() for key in values))
    content = {"name": "sweep", "command": command, "varying": varying, "parameters": keys, "columns": []}
    (folder / "sweep.json").write_text(json.dumps({**content, "cases": cases, **more}))
    return folder

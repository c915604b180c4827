"""Folders of results, made by hand: what tests of pictures and reports read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from pairsim.results.columns import named_row, series_columns
from pairsim.results.fields_writer import FieldsWriter
from pairsim.results.output import SeriesWriter
from pairsim.results.xdmf import FieldFrame


def make_run(folder: Path, n: int, frames: list[FieldFrame], rows: int = 12) -> Path:
    """A run of `n` particles with these fields and so many steps."""
    folder.mkdir()
    case = {"name": "sample", "particles": n, "beta": 0.4, "De": 0, "Ca_e": [0.1] * n, "d0": 0.1}
    (folder / "case.yaml").write_text(yaml.safe_dump(case))
    with SeriesWriter(folder / "series.csv", [*series_columns(n), "dt"]) as series:
        for t in np.linspace(0.1, 1, rows):
            gaps, order = np.full(max(n - 1, 0), 0.1 + 0.1 * t), np.arange(n)
            U = 1.5 + 0.01 * order * t
            row = named_row(t, gaps, U, np.diff(U), 0.01 * t * (order + 1), 640.0, 2.0)
            series.row(row | {"dt": 0.1})
    writer = FieldsWriter(folder)
    for frame in frames:
        writer.write(frame)
    return folder


def make_curve(folder: Path, Ca_e: float, De: float = 0.5, errors: tuple[str, ...] = ("mesh_error",)) -> Path:
    """A curve with an unstable zero at d = 0.2, whose columns of errors hold 1e-3, 2e-3, ..."""
    folder.mkdir(parents=True)
    d = np.array([0.05, 0.1, 0.2, 0.4, 0.6])
    table = {"d": d, "dU": Ca_e * np.log(d / 0.2), "slope": Ca_e / d, "D_L": d / 9, "D_T": -d / 9}
    table |= {name: np.full(5, 1e-3 * (i + 1)) for i, name in enumerate(errors)}
    rows = [",".join(map(repr, map(float, row))) for row in np.column_stack(list(table.values()))]
    (folder / "curve.csv").write_text("\n".join([",".join(table), *rows, ""]))
    (folder / "equilibria.csv").write_text("d,stable,slope,peak\n0.2,false,0.5,1\n")
    case = {"beta": 0.4, "De": De, "Ca_e": Ca_e, "particles": 2, "d": d.tolist()}
    case |= {"liquid": {"law": "giesekus", "alpha": 0.2}, "xi": 0.09} if De else {}
    (folder / "case.yaml").write_text(yaml.safe_dump(case | {"mesh": {"Np": 8 if De else 10}}))
    return folder

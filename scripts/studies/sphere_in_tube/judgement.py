"""The drag over De on all meshes, how far it is from that of the next coarser one, and the largest stress."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import pi
from pathlib import Path
from typing import Any

import pandas as pd
from book import comparison
from book.case_parts import complete
from book.comparison import Column, Table
from book.computing import DOCS
from book.drawing import png
from book.statements import Judged
from book.study import Part
from matplotlib import pyplot

from studies.sphere_in_tube import references as exact
from studies.sphere_in_tube.cases import ACCURACIES, INDICATORS

RADIUS = 0.25
"""Of the sphere [D_c]: De_b = lambda U/a is De over this."""
NAME = "De_b"


def drags(results: pd.DataFrame) -> pd.DataFrame:
    """K = F/(6 pi eta_0 a U), its half-width and De_b of all cases."""
    unit = 3 * pi * results["beta"]
    K, error = results["F_1"] / unit, results["F_error_1"] / unit
    return results.assign(K=K, error=error, **{NAME: (results["De"] / RADIUS).round(9)})


def meshes(rows: pd.DataFrame) -> pd.DataFrame:
    """K on each mesh, and of the finest with a solution what its stress is like; a row for each De_b."""
    wide: Any = rows.pivot(index=NAME, columns="accuracy", values=["K", "error", *INDICATORS])
    names = [name for name in ACCURACIES if name in rows["accuracy"].unique()]
    frame = pd.DataFrame(index=wide.index)
    for name in names:
        frame[name], frame[f"error {name}"] = wide["K"][name], wide["error"][name]
    for coarse, fine in pairwise(names):
        frame[f"{fine} less {coarse}, %"] = 100 * (1 - frame[coarse] / frame[fine])
    for name in INDICATORS:
        frame[name] = wide[name][names].ffill(axis=1).iloc[:, -1]
    return frame


def tables(results: pd.DataFrame) -> dict[str, Table]:
    """The tables of the page."""
    rows = drags(results)
    elastic = rows[rows["De"] > 0]
    frame = meshes(elastic)
    names = [name for name in ACCURACIES if name in frame]
    changes = [name for name in frame if str(name).endswith(", %")]
    answered = elastic.dropna(subset=["K"])
    largest = answered.groupby("accuracy")[["unknowns", NAME]].max().loc[names]
    return {
        "newtonian": Table(
            rows[rows["De"] == 0].reset_index(drop=True),
            [Column("K", error="error", to=exact.K, allowed=2e-5, source="the classical value")],
        ),
        "meshes": Table(
            frame,
            [
                *(Column(name, error=f"error {name}") for name in names),
                *(Column(str(name), shown=".2g") for name in changes),
                Column("`s_jump`", "s_jump", shown=".2g"),
                Column("largest tr **c**", "c_max", shown=".3g"),
                Column("z", "c_max_z", shown=".3f"),
                Column("r", "c_max_r", shown=".3f"),
            ],
        ),
        "unknowns": Table(largest, [Column("unknowns", shown=",.0f"), Column("answers up to De_b", NAME, shown=".1f")]),
    }


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That the Newtonian drag is the classical one, and that the drags on any two meshes agree within half-widths."""
    frame = meshes(drags(results[results["De"] > 0]))
    names = [name for name in ACCURACIES if name in frame]
    margins = [
        (float(errors - apart), 0.0)
        for coarse, fine in pairwise(names)
        for errors, apart in zip(
            frame[f"error {coarse}"] + frame[f"error {fine}"], (frame[coarse] - frame[fine]).abs(), strict=True
        )
        if apart == apart  # where both have a solution
    ]
    agree = Judged(tuple(margins), f"{sum(margin >= 0 for margin, _ in margins)} of {len(margins)} pairs of meshes")
    found = {"the drag is the same on all meshes within their half-widths": agree}
    return comparison.statements(tables(results)) | found | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    return comparison.blocks(tables(results))


def pictures(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[Path, bytes]:
    """K over De_b on all meshes."""
    frame = meshes(drags(results[results["De"] > 0]))
    figure, axis = pyplot.subplots(figsize=(5, 3.6))
    for name, marker in zip((name for name in ACCURACIES if name in frame), "sdo", strict=False):
        axis.errorbar(
            frame.index, frame[name], frame[f"error {name}"], marker=marker, ms=4, capsize=2, label=f"mesh of {name}"
        )
    axis.set(xlabel=r"$\mathrm{De}_b = \lambda U/a$", ylabel=r"$K = F/(6\pi\eta_0 a U)$", ylim=(4.8, 5.8))
    axis.legend()
    return {DOCS / "validation" / "images" / "sphere_in_tube.png": png(figure)}

"""Soft pairs in a Newtonian liquid against pyoomph, curve against curve; its numbers are a tracked table."""

from __future__ import annotations

import csv
from itertools import groupby

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot
from scipy.interpolate import CubicHermiteSpline

import pairsim
from pairsim.api.results import CurveResult
from validation_book.comparisons import BOOK, CONFIGS, Comparison, Found, Keys, Setting, number, rows_of, text_table

type Row = dict[str, float]
TABLE = BOOK / "pyoomph.csv"
OF_PEAK = 5e-4  # allowed difference of dU, relative to the largest |dU| of the curve
CASE = CONFIGS / "soft-curve.yaml"


def compute(setting: Setting) -> Found:
    """dU_held at every distance of the table, and the Taylor parameters."""
    with TABLE.open(newline="") as file:
        theirs = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    rows, curves, lines = [], {}, []
    for beta, group in groupby(theirs, key=lambda row: row["beta"]):
        if setting.quick and beta != 0.4:
            continue
        listed = list(group)
        finest = max(row["cells"] for row in listed)
        fine = [row for row in listed if row["cells"] == finest]
        coarse = {row["d"]: row["dU"] for row in listed if row["cells"] != finest}
        if setting.quick:
            fine = fine[1:2]
        keys: Keys = {"beta": beta, "d": [row["d"] for row in fine], "Ca_e": fine[0]["Ca_e"], "max_points": len(fine)}
        curve = pairsim.curve(CASE, **keys)
        ours = {row["d"]: row for row in rows_of(curve)}
        peak = max(abs(row["dU"]) for row in fine)
        rows += [row for each in fine for row in compared(each, ours[each["d"]], coarse[each["d"]], peak)]
        lines += [refined(each, ours[each["d"]], coarse[each["d"]], peak) for each in fine]
        curves[beta] = fine, curve
    draw(setting, curves)
    head = [
        "beta",
        "d",
        "dU on 40 cells",
        "dU on 80 cells",
        "change, % of the peak",
        "pairsim minus 80 cells, % of the peak",
    ]
    return Found(rows, {"refinement": text_table(head, lines)})


def compared(theirs: Row, ours: Row, coarse: float, peak: float) -> list[Comparison]:
    """One distance; allowed is what the last refinement of their mesh has changed, and a small part of the peak."""
    what, source = f"beta {theirs['beta']:g}, d {theirs['d']:g}", "pyoomph 0.2.2, 80 cells on a half-circle"
    allowed = (abs(theirs["dU"] - coarse) + OF_PEAK * peak) / abs(theirs["dU"])
    dU, headline = ours["dU_held"], theirs["d"] == 0.1
    return [
        Comparison(what, "dU_held", dU, ours["dU_error"], theirs["dU"], source, allowed, headline, "dU"),
        Comparison(what, "D_T", ours["D_T"], None, theirs["D_T"], source, 1e-2, table="shapes"),
        Comparison(what, "D_L", ours["D_L"], None, theirs["D_L"], source, 1e-2, table="shapes"),
    ]


def refined(theirs: Row, ours: Row, coarse: float, peak: float) -> list[str]:
    """dU on both of their meshes, and differences relative to the largest |dU| of the curve."""
    differences = theirs["dU"] - coarse, ours["dU_held"] - theirs["dU"]
    parts = [f"{100 * each / peak:+.2g}" for each in differences]
    return [f"{theirs['beta']:g}", f"{theirs['d']:g}", number(coarse), number(theirs["dU"]), *parts]


def draw(setting: Setting, curves: dict[float, tuple[list[Row], CurveResult]]) -> None:
    """Both curves of every confinement; distances are held in both."""
    figure, axes = pyplot.subplots(1, len(curves), figsize=(4 * len(curves), 3.2), squeeze=False)
    for axis, (beta, (theirs, ours)) in zip(axes[0], curves.items(), strict=True):
        d = [row["d"] for row in theirs]
        if len(d) > 1:
            between = np.geomspace(d[0], d[-1], 200)
            at, held, slope = (ours.table[name].to_numpy() for name in ("d", "dU_held", "slope"))
            line = CubicHermiteSpline(np.log(at), held, at * slope)
            axis.plot(between, 1e3 * line(np.log(between)), "-", label="pairsim")
        axis.plot(d, [1e3 * row["dU"] for row in theirs], "o", ms=5, mfc="none", label="pyoomph")
        axis.axhline(0, color="grey", lw=0.6)
        axis.set(xscale="log", xlabel=r"$d$", ylabel=r"$10^3\,\Delta U$ at held distance", title=rf"$\beta = {beta:g}$")
        axis.set_xticks(d, [f"{each:g}" for each in d])
        axis.minorticks_off()
        axis.legend()
    figure.tight_layout()
    figure.savefig(setting.pictures / "pyoomph.png", dpi=150)
    pyplot.close(figure)

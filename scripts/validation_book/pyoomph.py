"""Soft pairs in a Newtonian liquid against pyoomph, curve against curve; its numbers are a tracked table."""

from __future__ import annotations

import csv
from itertools import groupby

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot

import pairsim
from validation_book.comparisons import BOOK, CONFIGS, Comparison, Found, Keys, Setting, Subject, Table, number, rows_of

type Row = dict[str, float]
TABLE = BOOK / "pyoomph.csv"
CASE = CONFIGS / "soft-curve.yaml"


def compute(setting: Setting) -> Found:
    """dU at every distance of the table, with the estimated correction added, and the Taylor parameters."""
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
        ours = {row["d"]: row for row in rows_of(pairsim.curve(CASE, **keys))}
        rows += [row for each in fine for row in compared(each, ours, coarse)]
        lines += [refined(each, coarse[each["d"]]) for each in fine]
        curves[beta] = fine, ours
    draw(setting, curves)
    head = ["beta", "d", "dU on 40 cells", "dU on 80 cells", "change, %"]
    return Found(rows, {"refinement": Table(head, lines)})


def compared(
    theirs: dict[str, float], ours: dict[float, dict[str, float]], coarse: dict[float, float]
) -> list[Comparison]:
    """One distance; differences up to what the last refinement of their mesh has changed are allowed."""
    beta, d = theirs["beta"], theirs["d"]
    row, what = ours[d], f"beta {beta:g}, d {d:g}"
    allowed, source = 1e-3 + abs(coarse[d] / theirs["dU"] - 1), "pyoomph 0.2.2, 80 cells on a half-circle"
    dU = row["dU"] + row["dU_correction"]
    return [
        Comparison(what, "dU", dU, row["dU_error"], theirs["dU"], source, allowed, d == 0.1, "dU"),
        Comparison(what, "D_T", row["D_T"], None, theirs["D_T"], source, 1e-2, table="shapes"),
        Comparison(what, "D_L", row["D_L"], None, theirs["D_L"], source, 1e-2, table="shapes"),
    ]


def refined(theirs: Row, coarse: float) -> list[str]:
    """dU on both of their meshes, and the change."""
    change = 100 * (theirs["dU"] / coarse - 1)
    return [f"{theirs['beta']:g}", f"{theirs['d']:g}", number(coarse), number(theirs["dU"]), f"{change:+.2g}"]


def draw(setting: Setting, curves: dict[float, tuple[list[Row], dict[float, Row]]]) -> None:
    """Both curves of every confinement."""
    figure, axes = pyplot.subplots(1, len(curves), figsize=(4 * len(curves), 3.2), squeeze=False)
    for axis, (beta, (theirs, ours)) in zip(axes[0], curves.items(), strict=True):
        axis.plot(list(ours), [row["dU"] for row in ours.values()], "-", label="pairsim")
        axis.plot([row["d"] for row in theirs], [row["dU"] for row in theirs], "o", ms=5, mfc="none", label="pyoomph")
        axis.axhline(0, color="grey", lw=0.6)
        axis.set(xscale="log", xlabel=r"$d$", ylabel=r"$\Delta U$", title=rf"$\beta = {beta:g}$")
        axis.legend()
    figure.tight_layout()
    figure.savefig(setting.pictures / "pyoomph.png", dpi=150)
    pyplot.close(figure)


SUBJECT = Subject("pyoomph", compute)

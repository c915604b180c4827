"""dU_held and Taylor parameters beside those of pyoomph.

Its table of soft pairs in a Newtonian liquid was made by scripts/studies/codes; what it has found in a Giesekus liquid
is stored with the results.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from book import comparison, pages
from book.case_parts import complete
from book.comparison import Column, Table
from book.computing import DOCS
from book.drawing import png
from book.made import made
from book.statements import Judged
from book.study import Part
from matplotlib import pyplot
from scipy.interpolate import CubicHermiteSpline

from studies.pyoomph import viscoelastic_judgement
from studies.pyoomph.viscoelastic_judgement import of_kind

THEIRS = DOCS / "validation" / "pyoomph.csv"
OF_PEAK = 5e-4
"""Allowed difference relative to the largest |dU| of the curve, besides what their refinement changes."""
SOURCE = "pyoomph on 80 cells"


def theirs(cells: int) -> pd.DataFrame:
    """Their results on a mesh by beta and d."""
    found = pd.read_csv(THEIRS)
    return found[found["cells"] == cells].set_index(["beta", "d"])


def tables(results: pd.DataFrame) -> dict[str, Table]:
    """The tables of pairs in a Newtonian liquid."""
    coarse, fine = theirs(40), theirs(80)
    change, peak = fine["dU"] - coarse["dU"], fine["dU"].abs().groupby("beta").max()
    rows = of_kind(results).set_index(["beta", "d"]).join(fine[["dU", "D_T", "D_L"]].add_prefix("theirs "))
    rows["change"], rows["apart"] = 100 * change / peak, 100 * (rows["dU_held"] - fine["dU"]) / peak
    rows["what their refinement changes and 0.05 % of the peak"] = (change.abs() + OF_PEAK * peak) / fine["dU"].abs()
    allowed = "what their refinement changes and 0.05 % of the peak"
    return {
        "dU": Table(
            rows,
            [
                Column("dU_held", error="dU_error", to="theirs dU", allowed=allowed, source=SOURCE),
                Column("80 less 40 cells, % of the peak", "change", shown="+.2g"),
                Column("pairsim less 80 cells, % of the peak", "apart", shown="+.2g"),
            ],
        ),
        "shapes": Table(
            rows, [Column(name, to=f"theirs {name}", allowed=0.01, source=SOURCE) for name in ("D_T", "D_L")]
        ),
    }


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That all are as close as is allowed."""
    newtonian = comparison.statements(tables(results))
    return newtonian | viscoelastic_judgement.statements(results) | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    verdicts = {
        "made": pages.prose(made(results, parts)),
        "statements": comparison.stated(statements(results, parts)),
    }
    return comparison.blocks(tables(results)) | viscoelastic_judgement.blocks(results) | verdicts


def pictures(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[Path, bytes]:
    """Both curves of every confinement; distances are held in both."""
    found, fine = of_kind(results).groupby("beta", sort=False), theirs(80)
    figure, axes = pyplot.subplots(1, len(found), figsize=(4 * len(found), 3.2), squeeze=False)
    for axis, (beta, rows) in zip(axes[0], found, strict=True):
        d, held, slope = rows[["d", "dU_held", "slope"]].to_numpy().T
        if len(d) > 1:
            between = np.geomspace(d[0], d[-1], 200)
            axis.plot(between, 1e3 * CubicHermiteSpline(np.log(d), held, d * slope)(np.log(between)), label="pairsim")
        known = fine.loc[beta]["dU"]
        axis.plot(known.index, 1e3 * known, "o", ms=5, mfc="none", label="pyoomph")
        axis.axhline(0, color="grey", lw=0.6)
        title = rf"$\beta = {beta:g}$"
        axis.set(xscale="log", xlabel=r"$d$", ylabel=r"$10^3\,\Delta U$ at held distance", title=title)
        axis.set_xticks(d, [f"{each:g}" for each in d])
        axis.minorticks_off()
        axis.legend()
    return {DOCS / "validation" / "images" / "pyoomph.png": png(figure)}

"""The picture of the maps: lengths of tube of single beads, and growth rates of pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path

import pandas as pd
from book.computing import DOCS
from book.study import Part
from matplotlib.axes import Axes

from pairsim.plots.style import COLOURS, Page, printing
from studies.focus_maps.judgement import largest, of


def _over(axes: Axes, table: pd.DataFrame, x: str, y: str) -> None:
    """Lines over a column, one for each beta."""
    for i, (beta, rows) in enumerate(table.groupby("beta")):
        label = rf"$\beta$ = {beta:g}"
        axes.plot(rows[x], rows[y], ".-", color=COLOURS[i % len(COLOURS)], label=label, markersize=4)


@printing()
def pictures(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[Path, bytes]:
    """Four panels."""
    page = Page()
    figure, (soft, elastic, rigid, held) = page.panels(4)
    for axes, name, x, label in ((soft, "soft-bead", "Ca_e", r"\mathrm{Ca}_e"), (elastic, "elastic-bead", "De", "De")):
        _over(axes, of(results, name).dropna(subset="tube").sort_values(x), x, "tube")
        axes.set(xscale="log", yscale="log", xlabel=f"${label}$", ylabel=r"$L$  [$D_c$]")
    _over(rigid, of(results, "rigid-pairs").sort_values("d"), "d", "growth")
    rigid.set(xscale="log", xlabel=r"$d$  [$D_c$]", ylabel=r"$\mathrm{Re}\,\lambda$  [$U_{av}/D_c$]")
    for i, (name, key) in enumerate((("soft-pairs", "Ca_e"), ("elastic-pairs", "De"))):
        symbol = r"\mathrm{Ca}_e" if key == "Ca_e" else r"\mathrm{De}"
        for j, (beta, rows) in enumerate(largest(of(results, name), ("beta", key)).groupby("beta")):
            label = rf"$\beta$ = {beta:g}, over ${symbol}$"
            held.plot(rows[key], rows["growth"], "-" if i == 0 else "--", color=COLOURS[j], label=label, marker=".")
    held.axhline(0, color="0.5", linewidth=0.5)
    held.set(xscale="log", xlabel=r"$\mathrm{Ca}_e$ or $\mathrm{De}$")
    held.set(ylabel=r"largest $\mathrm{Re}\,\lambda$ over $d$  [$U_{av}/D_c$]", ylim=(-0.03, 0.03))
    for axes in (soft, elastic, rigid, held):
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=6)
    content = BytesIO()
    figure.savefig(content, format="png", dpi=page.dpi)
    return {DOCS / "images" / "focusing.png": content.getvalue()}

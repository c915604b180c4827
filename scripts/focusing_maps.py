"""Compute the maps of docs/explanation/focus-maps.md: which beads and pairs stay on the axis, and how fast they do.

    .venv/bin/python scripts/focusing_maps.py [-o runs/focusing] [--table]     half an hour on one core

Each file of configs/focus is a sweep; after an interruption the same command continues. Writes a table for each into
docs/results/focusing, and docs/images/focusing.png.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from book.computing import CONFIGS, DOCS, pairsim, parser_of
from matplotlib.axes import Axes

import pairsim as api
from pairsim.plots.style import COLOURS, Page, printing
from pairsim.record.folder import write_text

MAPS = ("soft-bead", "elastic-bead", "bead", "rigid-pairs", "soft-pairs", "elastic-pairs")
PARAMETERS = ["beta", "De", "Ca_e", "d"]
SHOWN = ["verdict", "growth", "growth_error", "tube", "Re_most"]
DIGITS = "%.4g"


def table_of(folder: Path) -> pd.DataFrame:
    """What a sweep has found, by its parameters."""
    found = api.open(folder).table
    keys = [key for key in PARAMETERS if key in found]
    finished = found[found["status"] == "finished"]
    table = finished[[*keys, *SHOWN]].sort_values(keys).reset_index(drop=True)
    missing = len(found) - len(finished)
    if missing:
        print(f"{folder}: {missing} of {len(found)} cases have no steady state, or were not computed")
    return table


def _over(axes: Axes, table: pd.DataFrame, x: str, y: str, by: str, label: str) -> None:
    """Lines over a column, one for each value of another one."""
    for i, (value, rows) in enumerate(table.groupby(by)):
        axes.plot(rows[x], rows[y], ".-", color=COLOURS[i % len(COLOURS)], label=f"{label} = {value:g}", markersize=4)


@printing()
def draw(tables: dict[str, pd.DataFrame], out: Path, page: Page) -> list[Path]:
    """Draw lengths of tube of single beads, and growth rates of pairs."""
    figure, (soft, elastic, rigid, held) = page.panels(4)
    for axes, name, x, label in ((soft, "soft-bead", "Ca_e", r"\mathrm{Ca}_e"), (elastic, "elastic-bead", "De", "De")):
        _over(axes, tables[name].dropna(subset="tube"), x, "tube", "beta", r"$\beta$")
        axes.set(xscale="log", yscale="log", xlabel=f"${label}$", ylabel=r"$L$  [$D_c$]")
    _over(rigid, tables["rigid-pairs"], "d", "growth", "beta", r"$\beta$")
    rigid.set(xscale="log", xlabel=r"$d$  [$D_c$]", ylabel=r"$\mathrm{Re}\,\lambda$  [$U_{av}/D_c$]")
    for i, (name, key) in enumerate((("soft-pairs", "Ca_e"), ("elastic-pairs", "De"))):
        worst = tables[name].groupby(["beta", key], as_index=False)["growth"].max()
        for j, (beta, rows) in enumerate(worst.groupby("beta")):
            symbol = r"\mathrm{Ca}_e" if key == "Ca_e" else r"\mathrm{De}"
            label = rf"$\beta$ = {beta:g}, over ${symbol}$"
            held.plot(rows[key], rows["growth"], "-" if i == 0 else "--", color=COLOURS[j], label=label, marker=".")
    held.axhline(0, color="0.5", linewidth=0.5)
    held.set(xscale="log", xlabel=r"$\mathrm{Ca}_e$ or $\mathrm{De}$")
    held.set(ylabel=r"largest $\mathrm{Re}\,\lambda$ over $d$  [$U_{av}/D_c$]", ylim=(-0.03, 0.03))
    for axes in (soft, elastic, rigid, held):
        axes.legend(fontsize=6)
    return page.save(figure, out, "focusing")


def main() -> int:
    """Compute, and write tables and picture."""
    parser = parser_of("focusing_maps.py", __doc__, "runs/focusing")
    arguments = parser.parse_args()
    output: Path = arguments.output
    tables = dict[str, pd.DataFrame]()
    for name in MAPS:
        if not arguments.table:
            pairsim("sweep", CONFIGS / "focus" / f"{name}.yaml", "-o", output / name, "--workers", arguments.workers)
        tables[name] = table_of(output / name)
        folder = DOCS / "results" / "focusing"
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / f"{name}.csv", tables[name].to_csv(index=False, float_format=DIGITS))
    assert np.isfinite(tables["rigid-pairs"]["growth"]).all()
    draw(tables, DOCS / "images", Page())
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""A row on its way along a tube: its distances over the position, and at inlet and outlet."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.results.units import LENGTH, POSITION
from pairsim.runtime.arrays import Array

FEW = 10  # distances that are drawn one by one
PARTS = (0.05, 0.25, 0.5, 0.75, 0.95)  # of more distances, those below a line
BINS = 30


@printing()
def draw_long_row(row: Mapping[str, Array], units: Units, out: Path, page: Page) -> list[Path]:
    """Draw the distances over the position, or quantiles of many, and their histograms at inlet and outlet.

    Args:
        row: The columns of row.csv in the units that are drawn.
        units: The units.
        out: Folder for the picture.
        page: What it is drawn for.
    """
    distances = pd.DataFrame(row).set_index("position").filter(regex="^d")
    figure, (over, histogram) = page.panels(2, 55)
    many, label = distances.shape[1] > FEW, f"$d_i$  [{units.name(LENGTH)}]"
    lines = distances.quantile(PARTS, axis=1).T.rename(columns="{:.0%}".format) if many else distances
    position = f"position along the tube  [{units.name(POSITION)}]"
    lines.plot(ax=over, xlabel=position, ylabel=label, style="-")
    ends = distances.iloc[[0, -1]].T.set_axis(["inlet", "outlet"], axis=1)
    ends.plot.hist(ax=histogram, bins=BINS, alpha=0.5, xlabel=label, ylabel="distances")
    return page.save(figure, out, "row")

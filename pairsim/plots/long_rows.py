"""A row on its way along a tube: its distances over the position, and at inlet and outlet."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.plots.style import COLOURS, GREY, Page, printing
from pairsim.plots.units import Units
from pairsim.results.units import LENGTH, POSITION
from pairsim.runtime.arrays import Array

FEW = 10  # distances that are drawn one by one
PARTS = (5, 25, 50, 75, 95)  # of more distances, those that are below a line, in per cent
BINS = 30


@printing()
def draw_long_row(row: Mapping[str, Array], units: Units, out: Path, page: Page) -> list[Path]:
    """Draw the distances over the position, those of few beads one by one, and their histograms at inlet and outlet.

    Args:
        row: The columns of row.csv in the units that are drawn.
        units: The units.
        out: Folder for the picture.
        page: What it is drawn for.
    """
    position, distances = row["position"], np.array([row[name] for name in row if name.startswith("d")])
    figure, (over, histogram) = page.panels(2, 55)
    if len(distances) <= FEW:
        for i, each in enumerate(distances, 1):
            over.plot(position, each, linestyle="-", marker="", label=f"$d_{{{i}}}$")
    else:
        lines = np.percentile(distances, PARTS, axis=0)
        for below, above, label in ((0, 4, "90 %"), (1, 3, "50 %")):
            over.fill_between(position, lines[below], lines[above], color=COLOURS[0], alpha=0.25, label=label)
        over.plot(position, lines[2], color=COLOURS[0], linestyle="-", marker="", label="median")
    ends, length = distances[:, [0, -1]], units.name(LENGTH)
    bins = np.linspace(ends.min(), np.percentile(ends, 99.5), BINS)
    looks: tuple[dict[str, Any], ...] = ({"color": GREY}, {"color": COLOURS[0], "histtype": "step", "linewidth": 1.2})
    for values, label, look in zip(ends.T, ("inlet", "outlet"), looks, strict=True):
        histogram.hist(np.minimum(values, bins[-1]), bins.tolist(), label=label, **look)
    over.set(xlabel=f"position along the tube  [{units.name(POSITION)}]", ylabel=f"$d_i$  [{length}]")
    histogram.set(xlabel=f"$d_i$  [{length}]", ylabel="distances")
    for axis in (over, histogram):
        axis.legend()
    return page.save(figure, out, "row")

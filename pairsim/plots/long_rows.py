"""A long row on its way along a tube: its distances over the position, and at inlet and outlet."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pairsim.plots.style import COLOURS, GREY, Page, printing
from pairsim.plots.units import Units
from pairsim.results.units import LENGTH, POSITION
from pairsim.runtime.arrays import Array

PARTS = (5, 25, 50, 75, 95)  # of the distances that are below a line, in per cent
BINS = 30


@printing()
def draw_long_row(position: Array, distances: Array, units: Units, out: Path, page: Page) -> list[Path]:
    """Draw between what the distances lie over the position, and their histograms at inlet and outlet.

    Args:
        position: Mean position of the row at some times, in the units that are drawn, shape (m,).
        distances: The distances then, in these units, shape (m, N-1).
        units: The units.
        out: The file, without its ending.
        page: What it is drawn for.
    """
    figure, (over, histogram) = page.panels(2, 55)
    for low, high in ((0, 4), (1, 3)):
        below, above = (np.percentile(distances, PARTS[i], axis=1) for i in (low, high))
        over.fill_between(position, below, above, color=COLOURS[0], alpha=0.25, linewidth=0)
        over.plot(
            [], [], color=COLOURS[0], alpha=0.5 if low else 0.25, linewidth=6, label=f"{PARTS[high] - PARTS[low]} %"
        )
    over.plot(
        position, np.percentile(distances, 50, axis=1), color=COLOURS[0], linestyle="-", marker="", label="median"
    )
    length = units.name(LENGTH)
    over.set(xlabel=f"position along the tube  [{units.name(POSITION)}]", ylabel=f"$d_i$  [{length}]")
    ends = distances[[0, -1]]
    bins = np.linspace(float(ends.min()), float(np.percentile(ends, 99.5)), BINS)
    looks: tuple[dict[str, Any], ...] = ({"color": GREY}, {"color": COLOURS[0], "histtype": "step", "linewidth": 1.2})
    for values, label, look in zip(ends, ("inlet", "outlet"), looks, strict=True):
        histogram.hist(np.minimum(values, bins[-1]), bins.tolist(), label=label, **look)
    histogram.set(xlabel=f"$d_i$  [{length}]", ylabel="distances")
    for axis in (over, histogram):
        axis.legend()
    return page.save(figure, out.parent, out.name)

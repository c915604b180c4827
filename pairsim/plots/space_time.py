"""Many particles: a row for each gap or particle, time along it, and the value as its colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pairsim.plots.style import DIVERGING, SEQUENTIAL, Page
from pairsim.plots.units import Units
from pairsim.runtime.arrays import Array

OUTLIERS = 0.01  # part of the values at either end that a scale does not cover
EVEN = 400  # times


def draw_space_time(
    page: Page, series: Mapping[str, Array], quantities: Sequence[Sequence[str]], drawn: Units
) -> Figure:
    """The distances, how they have changed, relative velocities and D, a panel each.

    Args:
        page: What it is drawn for.
        series: Columns of series.csv.
        quantities: Columns of each quantity, the distances first.
        drawn: The units of the columns.
    """
    times = np.linspace(series["t"][0], series["t"][-1], EVEN)
    rows = [np.array([np.interp(times, series["t"], series[name]) for name in names]) for names in quantities]
    labels = [drawn.axis_label([names[0]]).replace("_{1}", "_i") for names in quantities]
    change = labels[0].replace("$d_i$", "$d_i - d_i(0)$")
    panels = list(zip(rows, labels, strict=True))
    panels.insert(1, (rows[0] - rows[0][:, :1], change))
    figure, axes = page.panels(len(panels), height=52)
    for axis, (values, label) in zip(axes, panels, strict=True):
        low, high = np.quantile(values, [OUTLIERS, 1 - OUTLIERS])
        look: dict[str, Any] = {"vmin": low, "vmax": high, "cmap": SEQUENTIAL}
        if values is not rows[0]:
            reach = max(-low, high) or 1.0
            look = {"vmin": -reach, "vmax": reach, "cmap": DIVERGING}
        numbers = np.arange(1, len(values) + 1)
        mesh = axis.pcolormesh(times, numbers, values, shading="nearest", rasterized=True, **look)
        figure.colorbar(mesh, ax=axis, label=label, aspect=25, extend="both", ticks=MaxNLocator(5))
        axis.set(xlabel=drawn.axis_label(["t"]), ylabel="particle" if label.startswith("$D") else "gap, from upstream")
        axis.yaxis.set_major_locator(MaxNLocator(6, integer=True))
        axis.grid(visible=False)
    return figure

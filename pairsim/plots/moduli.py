"""The events of a cytometer over lines of equal modulus."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm

from pairsim.plots.style import GREY, ORDERED, Page, colour_bar, printing
from pairsim.results.cytometry import modulus_at
from pairsim.runtime.arrays import Array


@printing()
def draw_moduli(events: Array, look_up: Array, out: Path) -> None:
    """Draw events over lines of equal modulus of a table, (m, 4): area, deformation, modulus, error; a PNG file."""
    area, deformation, modulus, _ = events.T
    inside, outside = np.isfinite(modulus), np.isnan(modulus)
    low, high = map(float, np.nanpercentile(modulus, (1, 99)))
    look: dict[str, Any] = {"s": 3.0, "linewidths": 0, "rasterized": True}
    figure = (page := Page(width=120.0)).figure(80.0)
    axes = figure.add_subplot(xlabel=r"area  [$\mathrm{\mu m^2}$]", ylabel="deformation")
    axes.scatter(area[outside], deformation[outside], color=GREY, **look)
    look |= {"c": modulus[inside], "norm": LogNorm(low, high), "cmap": ORDERED}
    shown = axes.scatter(area[inside], deformation[inside], **look)
    x, y = np.meshgrid(*(np.linspace(each.min(), each.max(), 90) for each in look_up.T[:2]))
    lines, _ = modulus_at(look_up, x.ravel(), y.ravel())
    drawn = axes.contour(x, y, lines.reshape(x.shape), levels=np.geomspace(low, high, 7), colors="0.3", linewidths=0.6)
    axes.clabel(drawn, fmt=lambda level: f"{level:.3g}", fontsize=6)
    colour_bar(figure, shown, ax=axes, label="Young's modulus  [kPa]")
    page.save(figure, out.parent, out.stem)

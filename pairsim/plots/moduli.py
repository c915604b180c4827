"""The events of a cytometer over lines of equal modulus."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import LogNorm

from pairsim.plots.style import GREY, ORDERED, Page, colour_bar, printing
from pairsim.runtime.arrays import Array

if TYPE_CHECKING:
    import pandas as pd

LEVELS = 7


@printing()
def draw_moduli(table: pd.DataFrame, lines: tuple[Array, Array, Array], out: Path) -> None:
    """Draw deformation over area, coloured by Young's modulus, and lines of equal modulus; a PNG file.

    Args:
        table: The events, as in `pairsim.api.moduli.Moduli`.
        lines: Areas (n,), deformations (m,) and the moduli there, (m, n).
        out: The file.
    """
    area, deformation, modulus, _ = table.to_numpy().T
    inside, outside = np.isfinite(modulus), np.isnan(modulus)
    low, high = map(float, np.nanpercentile(modulus, (1, 99)))
    look: dict[str, Any] = {"s": 3.0, "linewidths": 0, "rasterized": True}
    figure = (page := Page(width=120.0)).figure(80.0)
    axes = figure.add_subplot(xlabel=r"area  [$\mathrm{\mu m^2}$]", ylabel="deformation")
    axes.scatter(area[outside], deformation[outside], color=GREY, **look)
    look |= {"c": modulus[inside], "norm": LogNorm(low, high), "cmap": ORDERED}
    shown = axes.scatter(area[inside], deformation[inside], **look)
    drawn = axes.contour(*lines, levels=np.geomspace(low, high, LEVELS), colors="0.3", linewidths=0.6)
    axes.clabel(drawn, fmt=lambda level: f"{level:.3g}", fontsize=6)
    colour_bar(figure, shown, ax=axes, label="Young's modulus  [kPa]")
    page.save(figure, out.parent, out.stem)

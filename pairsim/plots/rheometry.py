"""What a rheometer measured and the liquid fitted to it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pairsim.plots.chart import POINT, Panel, Series, draw_chart
from pairsim.plots.style import COLOURS, LINES, Page, printing

if TYPE_CHECKING:
    from pairsim.physics.rheometry import Fit, Measured

CURVES = {
    "viscosity": ("shear rate  [1/s]", r"viscosity  [Pa s]", "o"),
    "N1": ("shear rate  [1/s]", r"$N_1$  [Pa]", "s"),
    "storage": ("angular frequency  [rad/s]", r"$G'$  [Pa]", "^"),
    "loss": ("angular frequency  [rad/s]", r"$G''$  [Pa]", "v"),
}
"""Abscissa, words and marker of each curve."""


@printing()
def draw_fit(fit: Fit, data: Measured, out: Path) -> None:
    """Points and lines of the flow curve and of the moduli, a panel each; a PNG file."""
    panels, series = {}, []
    for i, (name, x, y) in enumerate(data.curves):
        over, words, marker = CURVES[name]
        panels[over] = Panel(over, "", wide="xy")
        fine = np.geomspace(x.min(), x.max(), 80)
        hollow: dict[str, Any] = {"color": COLOURS[i], "marker": marker, "markerfacecolor": "none", "markersize": 3.5}
        series.append(Series(over, x, y, look=hollow, mark=POINT, label=words))
        series.append(Series(over, fine, fit.of(name, fine), look={"color": COLOURS[i], "linestyle": LINES[i]}))
    page = Page()
    figure, _ = draw_chart(page, panels, series, [f"{fit.law.label}: points measured, lines fitted"])
    page.save(figure, out.parent, out.stem)

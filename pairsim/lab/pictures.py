"""Pictures of measurements beside models: films of two beads, flow curves and moduli, events of a cytometer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import LogNorm

from pairsim.lab.cytometer.look_up_table import modulus_at
from pairsim.plots.chart import POINT, Line, Panel, draw_chart
from pairsim.plots.style import COLOURS, GREY, LINES, ORDERED, Look, Page, colour_bar, printing
from pairsim.runtime.arrays import Array

if TYPE_CHECKING:
    from pairsim.lab.rheometer.law_fits import Fit
    from pairsim.lab.rheometer.measured import Measured

CURVES = {
    "viscosity": ("shear rate  [1/s]", r"viscosity  [Pa s]", "o"),
    "N1": ("shear rate  [1/s]", r"$N_1$  [Pa]", "s"),
    "storage": ("angular frequency  [rad/s]", r"$G'$  [Pa]", "^"),
    "loss": ("angular frequency  [rad/s]", r"$G''$  [Pa]", "v"),
}
"""Labels of abscissa and ordinate, and marker, of each curve."""
LEAST_SPAN = 1.05  # smallest ratio of the limits of the colour scale of moduli


@printing()
def draw_film(film: tuple[Array, Array], lines: Mapping[str, tuple[Array, Array]], out: Path, page: Page) -> list[Path]:
    """Draw `film`: measured distances over time, those of models, and the residuals of the models.

    Args:
        film: Times [s] and distances [um], shape (frames,) each.
        lines: Times [s] and distances [um] of each model by its name, shape (n,) each.
        out: The folder of the picture.
        page: How it is drawn.

    Returns:
        The files written.
    """
    panels = {"d": Panel("$t$  [s]", "$d$  [µm]"), "off": Panel("$t$  [s]", "model - film  [µm]")}
    hollow: Look = {"marker": "o", "markerfacecolor": "none", "markersize": 3}
    series = [Line("d", *film, look={**hollow, "color": "0.5"}, mark=POINT, label="film")]
    for (name, (t, d)), colour, line in zip(lines.items(), COLOURS, LINES, strict=False):
        times, seen = (each[(t[0] <= film[0]) & (film[0] <= t[-1])] for each in film)
        series.append(Line("d", t, d, look={"color": colour, "linestyle": line}, label=name))
        series.append(Line("off", times, np.interp(times, t, d) - seen, look={**hollow, "color": colour}, mark=POINT))
    figure, _ = draw_chart(page, panels, series, [])
    return page.save(figure, out, "film")


@printing()
def draw_fit(fit: Fit, data: Measured, out: Path) -> None:
    """Draw the measured points and the fitted lines of flow curve and moduli, in a panel each, to a PNG file."""
    panels, series = {}, []
    shared = Counter(CURVES[name][0] for name, _, _ in data.curves)
    for i, (name, x, y) in enumerate(data.curves):
        over, words, marker = CURVES[name]
        label = words if shared[over] > 1 else ""  # else the axis has it
        panels[over] = Panel(over, "" if label else words, logarithmic=True)
        fine = np.geomspace(x.min(), x.max(), 80)
        hollow: Look = {"color": COLOURS[i], "marker": marker, "markerfacecolor": "none", "markersize": 3.5}
        series.append(Line(over, x, y, look=hollow, mark=POINT, label=label))
        series.append(Line(over, fine, fit.of(name, fine), look={"color": COLOURS[i], "linestyle": LINES[i]}))
    page = Page()
    figure, _ = draw_chart(page, panels, series, [f"{fit.law.label}: points measured, lines fitted"])
    page.save(figure, out.parent, out.stem)


@printing()
def draw_moduli(events: Array, look_up: Array, out: Path) -> None:
    """Draw events over lines of equal modulus to a PNG file.

    Args:
        events: Area [um^2], deformation, Young's modulus and its half-width [kPa], both nan outside of the look-up
            table, shape (n, 4).
        look_up: The look-up table: area [um^2], deformation, modulus [kPa] and its relative half-width, shape (m, 4).
        out: The file.
    """
    area, deformation, modulus, _ = events.T
    inside, outside = np.isfinite(modulus), np.isnan(modulus)
    low, high = map(float, np.nanpercentile(modulus, (1, 99)))
    if high < LEAST_SPAN * low:  # a single event, or events that hardly differ
        low, high = low / LEAST_SPAN, high * LEAST_SPAN
    figure = (page := Page(width=120.0)).figure(80.0)
    axes = figure.add_subplot(xlabel=r"area  [$\mathrm{\mu m^2}$]", ylabel="deformation")
    axes.scatter(area[outside], deformation[outside], s=3.0, linewidths=0, color=GREY, rasterized=True)
    shown = axes.scatter(
        area[inside],
        deformation[inside],
        s=3.0,
        c=modulus[inside],
        norm=LogNorm(low, high),
        cmap=ORDERED,
        linewidths=0,
        rasterized=True,
    )
    x, y = np.meshgrid(*(np.linspace(each.min(), each.max(), 90) for each in look_up.T[:2]))
    lines, _ = modulus_at(look_up, x.ravel(), y.ravel())
    drawn = axes.contour(x, y, lines.reshape(x.shape), levels=np.geomspace(low, high, 7), colors="0.3", linewidths=0.6)
    axes.clabel(drawn, fmt=lambda level: f"{level:.3g}", fontsize=6)
    colour_bar(figure, shown, ax=axes, label="Young's modulus  [kPa]")
    page.save(figure, out.parent, out.stem)

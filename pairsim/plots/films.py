"""Films of two beads, and what models of their motion say."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.plots.chart import POINT, Panel, Series, draw_chart
from pairsim.plots.style import COLOURS, LINES, Page, printing
from pairsim.runtime.arrays import Array


@printing()
def draw_film(film: tuple[Array, Array], lines: Mapping[str, tuple[Array, Array]], out: Path, page: Page) -> list[Path]:
    """Draw `film`: its distances [um] over times [s], lines of models by their names, and by how much these are off."""
    panels = {"d": Panel("$t$  [s]", "$d$  [µm]"), "off": Panel("$t$  [s]", "model - film  [µm]")}
    hollow: dict[str, Any] = {"marker": "o", "markerfacecolor": "none", "markersize": 3}
    series = [Series("d", *film, look=hollow | {"color": "0.5"}, mark=POINT, label="film")]
    for (name, (t, d)), colour, line in zip(lines.items(), COLOURS, LINES, strict=False):
        times, seen = (each[(t[0] <= film[0]) & (film[0] <= t[-1])] for each in film)
        series.append(Series("d", t, d, look={"color": colour, "linestyle": line}, label=name))
        series.append(Series("off", times, np.interp(times, t, d) - seen, look=hollow | {"color": colour}, mark=POINT))
    figure, _ = draw_chart(page, panels, series, [])
    return page.save(figure, out, "film")

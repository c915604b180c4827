"""What a rheometer measured and the liquid fitted to it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pairsim.plots.style import Page, picture_file, printing

if TYPE_CHECKING:
    from pairsim.physics.rheometry import Fit, Measured

LOOKS = {
    "viscosity": ("C0", "o", r"viscosity [Pa s]", 0),
    "N1": ("C1", "s", r"$N_1$ [Pa]", 0),
    "storage": ("C2", "^", r"$G'$ [Pa]", 1),
    "loss": ("C3", "v", r"$G''$ [Pa]", 1),
}


@printing()
def draw_fit(fit: Fit, data: Measured, out: Path) -> None:
    """Points and lines of the flow curve and of the moduli, a panel each; a PNG file."""
    page = Page.parse()
    panels = sorted({LOOKS[name][3] for name, _, _ in data.curves})
    figure = page.figure(70.0)
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    for name, x, y in data.curves:
        colour, marker, label, panel = LOOKS[name]
        axis, fine = axes[panels.index(panel)], np.geomspace(x.min(), x.max(), 80)
        axis.loglog(x, y, marker, color=colour, markerfacecolor="none", label=label)
        axis.loglog(fine, fit.of(name, fine), color=colour)
        axis.set_xlabel(("shear rate [1/s]", "angular frequency [rad/s]")[panel])
    for axis in axes:
        axis.legend(frameon=False)
    axes[0].set_title(f"{fit.law.label}: points measured, lines fitted", loc="left")
    with picture_file(out) as file:
        figure.savefig(file, format="png")

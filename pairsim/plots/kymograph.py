"""Beads on their way along a tube: the position of each relative to the mean of all."""

from __future__ import annotations

import numpy as np

from pairsim.plots.chart import Line, Panel
from pairsim.plots.style import COLOURS, Look
from pairsim.plots.units import Units
from pairsim.quantities.kinds import LENGTH, POSITION
from pairsim.record.column import Column
from pairsim.record.columns import T, Z
from pairsim.record.table import Table


def kymograph(units: Units, beads: Table, way: Column) -> tuple[dict[str, Panel], list[Line]]:
    """The panel, and a line for each bead, over the mean position of all, with a scale of times above.

    Args:
        units: The units of the picture.
        beads: A table with the positions of the beads and times, in these units.
        way: The column of the mean position of all.
    """
    places = list(beads.each(Z).values())
    middle = np.mean(places, axis=0)
    to_lengths = units.factor(LENGTH) / units.factor(POSITION)  # columns of positions are in mm, beads are um apart
    look: Look = {"color": COLOURS[0], "linestyle": "-"}
    lines = [Line("beads", beads[way], to_lengths * (z - middle), look=look) for z in places]
    time = units.axis_label([T]), beads[way], beads[T]
    label = rf"$z_i - \bar{{z}}$  [{units.name(LENGTH)}]"
    return {"beads": Panel(units.axis_label([way]), label, above=time)}, lines

"""Streams along the tube: shares of drops, beads in contact, spread and histograms of distances, and a kymograph."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pairsim.plots.chart import Line, Panel, draw_chart
from pairsim.plots.kymograph import kymograph
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.style import COLOURS, LINES, Look, Page, printing
from pairsim.plots.units import Units
from pairsim.quantities.kinds import POSITION
from pairsim.questions.stream import (
    DISTANCES,
    DOUBLE,
    EMPTY,
    IN_CONTACT,
    KYMOGRAPH,
    LEAST,
    PART,
    POISSON,
    POSITION_OF_STREAM,
    SINGLE,
    SPREAD,
    STREAM,
)
from pairsim.record.table import Table
from pairsim.record.table_files import read_table

DROPS = {EMPTY: "none", SINGLE: "one bead", DOUBLE: "two"}


@printing()
def draw_stream(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `stream`, shares and spread over the position with histograms at its ends, and `kymograph`."""
    units = Units.of(directory, page.physical)
    stream, distances, beads = (
        read_table(directory / f"{name}.csv", columns, missing_ok=True).converted(units.scales)
        for name, columns in (("stream", STREAM), ("distances", DISTANCES), ("kymograph", KYMOGRAPH))
    )
    if not stream:
        return []
    parts = case_parts(read_case(directory / "case.yaml"), {"particles"}, units.scales is not None)
    z, label = stream[POSITION_OF_STREAM], units.axis_label([POSITION_OF_STREAM])
    panels: dict[Any, Panel] = {}
    lines: list[Line] = []
    if np.isfinite(stream[SINGLE]).all():
        panels["drops"] = Panel(label, "share of drops (dotted: Poisson)", margins=(0.05, 0.25))
        for i, (column, name) in enumerate(DROPS.items()):
            look: Look = {"color": COLOURS[i], "linestyle": LINES[0]}
            lines.append(Line("drops", z, stream[column], _half_widths(stream, column.name), look=look, label=name))
            independent: Look = {"color": COLOURS[i], "linestyle": ":"}
            lines.append(Line("drops", z, stream[POISSON[column]], look=independent))
    for column, words in ((IN_CONTACT, "share of beads in contact"), (SPREAD, "distances: standard deviation / mean")):
        panels[column] = Panel(label, words)
        look = {"color": COLOURS[0], "linestyle": "-"}
        lines.append(Line(column, z, stream[column], _half_widths(stream, column.name), look=look))
    panels["distances"] = Panel(units.axis_label([LEAST]), "part of the distances")
    for i, place in enumerate(np.unique(distances[POSITION_OF_STREAM])):
        here = distances[POSITION_OF_STREAM] == place
        look = {"drawstyle": "steps-post", "color": COLOURS[i], "linestyle": LINES[i]}
        name = "inlet" if not place else f"after {place:.3g} {units.name(POSITION)}"
        lines.append(Line("distances", distances[LEAST][here], distances[PART][here], label=name, look=look))
    charts = {"stream": (panels, lines), "kymograph": kymograph(units, beads, POSITION_OF_STREAM)}
    return [
        path
        for n, chart in charts.items()
        for path in page.save(draw_chart(page, *chart, parts, bands="half-width")[0], out, n)
    ]


def _half_widths(table: Table, name: str) -> Any:
    return np.hypot(table[f"{name}_error"], table[f"{name}_model"])

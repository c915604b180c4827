"""Growth rates of trains, and the distances of rows of beads along a tube."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pairsim.plots.chart import POINT, Panel, Series, draw_chart
from pairsim.plots.labels import case_parts, read_case, tex_number
from pairsim.plots.lines import told_apart
from pairsim.plots.style import COLOURS, LINES, Page, printing
from pairsim.plots.units import Units
from pairsim.quantities.kinds import LENGTH
from pairsim.results.columns import suffixes_in
from pairsim.results.table_files import read_table


@printing()
def draw_train(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `train`: growth rates and frequencies over k; and `row`: distances over position, and at both ends."""
    units = Units.of(directory, page.physical)
    train, waves, row = (
        units.table(read_table(directory / f"{name}.csv", missing_ok=True)) for name in ("train", "spectrum", "row")
    )
    parts = case_parts(read_case(directory / "case.yaml"), {"particles"}, units.scales is not None)
    parts.append(f"$d = {tex_number(train['d'][0])}$ {units.name(LENGTH)}")
    panels = {n: Panel(units.axis_label(["k"]), units.axis_label([n])) for n in ("growth", "frequency")}
    charts = {"train": (panels, [Series(n, waves["k"], waves[n], waves[f"{n}_error"], mark=POINT) for n in panels])}
    if row:
        z, gaps = next(iter(row)), [f"d{each}" for each in suffixes_in(row, "d")]
        ends = [np.array([row[name][at] for name in gaps]) for at in (0, -1)]
        bins, label = np.histogram_bin_edges(ends, "auto"), units.axis_label(gaps)
        lines = told_apart([Series("on the way", row[z], row[name], columns=(z, name)) for name in gaps])
        for name, d, colour, dashes in zip(("inlet", "outlet"), ends, COLOURS, LINES, strict=False):
            look = {"drawstyle": "steps-post", "color": colour, "linestyle": dashes}
            lines.append(Series("at the ends", bins, np.append(np.histogram(d, bins)[0], 0), label=name, look=look))
        shown = {"on the way": Panel(units.axis_label([z]), label), "at the ends": Panel(label, "number of distances")}
        charts["row"] = shown, lines
    return [path for n, chart in charts.items() for path in page.save(draw_chart(page, *chart, parts)[0], out, n)]

"""Growth rates of trains, and the distances and positions of rows of beads along a tube."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pairsim.plots.chart import POINT, Panel, Series, draw_chart
from pairsim.plots.labels import case_parts, read_case, tex_number
from pairsim.plots.lines import told_apart
from pairsim.plots.style import COLOURS, LINES, Page, printing
from pairsim.plots.units import Units
from pairsim.quantities.kinds import LENGTH, POSITION
from pairsim.results.columns import suffixes_in
from pairsim.results.table_files import read_table
from pairsim.runtime.arrays import Array


@printing()
def draw_train(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `train`, growth rates and frequencies over k, and of a row `row` and `kymograph`.

    `row` has the distances over the position, and those at both ends; `kymograph` has the beads beside their middle.
    """
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
        charts["kymograph"] = _kymograph(units, row)
    return [path for n, chart in charts.items() for path in page.save(draw_chart(page, *chart, parts)[0], out, n)]


def _kymograph(units: Units, row: Mapping[str, Array]) -> tuple[dict[str, Panel], list[Series]]:
    """The positions of the beads beside their middle, a line each, over that of the row, and over the time above."""
    way, names = next(iter(row)), [f"z{each}" for each in suffixes_in(row, "z")]
    middle = np.mean([row[name] for name in names], axis=0)
    to_lengths = units.factor(LENGTH) / units.factor(POSITION)  # columns of positions are in mm, beads are um apart
    look = {"color": COLOURS[0], "linestyle": "-"}
    beads = [Series("beads", row[way], to_lengths * (row[name] - middle), look=look) for name in names]
    time = units.axis_label(["t"]), row[way], row["t"]
    label = rf"$z_i - \bar{{z}}$  [{units.name(LENGTH)}]"
    return {"beads": Panel(units.axis_label([way]), label, above=time)}, beads

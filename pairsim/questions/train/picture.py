"""Growth rates of trains, and the distances and positions of rows of beads along a tube."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pairsim.plots.chart import POINT, Line, Panel, draw_chart
from pairsim.plots.kymograph import kymograph
from pairsim.plots.labels import case_parts, read_case, tex_number
from pairsim.plots.lines import told_apart
from pairsim.plots.style import COLOURS, LINES, Look, Page, printing
from pairsim.plots.units import Units
from pairsim.quantities.kinds import LENGTH
from pairsim.questions.train import FREQUENCY, GROWTH, POSITION_OF_ROW, ROW, SPECTRUM, TRAIN, D, K
from pairsim.record.columns import DISTANCE
from pairsim.record.table_files import read_table


@printing()
def draw_train(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `train`, growth rates and frequencies over k, and, if a row was followed, `row` and `kymograph`.

    `row` shows the distances over the position, and histograms of them at both ends; `kymograph` shows the beads
    relative to their middle.
    """
    units = Units.of(directory, page.physical)
    train, waves, row = (
        read_table(directory / f"{name}.csv", columns, missing_ok=True).converted(units.scales)
        for name, columns in (("train", TRAIN), ("spectrum", SPECTRUM), ("row", ROW))
    )
    parts = case_parts(read_case(directory / "case.yaml"), {"particles"}, units.scales is not None)
    parts.append(f"$d = {tex_number(train[D][0])}$ {units.name(LENGTH)}")
    panels = {each: Panel(units.axis_label([K]), units.axis_label([each])) for each in (GROWTH, FREQUENCY)}
    rates = [Line(each, waves[K], waves[each], waves.half_widths(each), mark=POINT) for each in panels]
    charts: dict[str, tuple[dict[Any, Panel], list[Line]]] = {"train": (panels, rates)}
    if row:
        gaps = {suffix: DISTANCE.with_suffix(suffix) for suffix in row.suffixes(DISTANCE)}
        ends = [np.array([row[gap][at] for gap in gaps.values()]) for at in (0, -1)]
        bins, label = np.histogram_bin_edges(ends, "auto"), units.axis_label([*gaps.values()])
        z = row[POSITION_OF_ROW]
        lines = told_apart([Line("on the way", z, row[gap], columns=(POSITION_OF_ROW, gap)) for gap in gaps.values()])
        for name, d, colour, dashes in zip(("inlet", "outlet"), ends, COLOURS, LINES, strict=False):
            look: Look = {"drawstyle": "steps-post", "color": colour, "linestyle": dashes}
            lines.append(Line("at the ends", bins, np.append(np.histogram(d, bins)[0], 0), label=name, look=look))
        shown = {
            "on the way": Panel(units.axis_label([POSITION_OF_ROW]), label),
            "at the ends": Panel(label, "number of distances"),
        }
        charts["row"] = shown, lines
        charts["kymograph"] = kymograph(units, row, POSITION_OF_ROW)
    return [path for n, chart in charts.items() for path in page.save(draw_chart(page, *chart, parts)[0], out, n)]

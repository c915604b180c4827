"""Pictures of the figures of the paper: panels of lines, outlines, meshes or fields."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, product
from pathlib import Path
from typing import Any

import meshio
import numpy as np
from book.cases import Case, Cases, NotComputed
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pairsim.plots.chart import by_rows, fill, finish, key
from pairsim.plots.frames import FIELDS, outlines
from pairsim.plots.labels import equation
from pairsim.plots.lines import fine_distances
from pairsim.plots.sections import draw_view, layer_of, scale_of, sheet, views_of
from pairsim.plots.style import COLOURS, LINES, MARKERS, NARROW, Page, printing
from pairsim.plots.units import Units
from pairsim.record.columns import CA_E, DISTANCE, SHARED, T
from studies.paper.words import distances

WIDTHS = (85, 170)
"""Widths of the pictures: one and two columns of a journal [mm]."""
HEIGHTS = {"shapes": 0.44, "mesh": 0.32}
"""Heights of panels over their widths; 56 mm for others."""
AXES = {"curves": DISTANCE.with_suffix(""), "runs": T, "critical": CA_E}
"""The column that lines are drawn over."""
LABELS = (r"$z\ [D_c]$", r"$r\ [D_c]$")
LETTERS = "abcdefgh"
MARGIN = 0.06  # around the particles, where the liquid is not of interest [D_c]


@dataclass(frozen=True)
class Panel:
    """A panel of a picture.

    Attributes:
        kind: curves, runs, critical, shapes, fields or mesh.
        of: Computations as FIGURE/FILE, such as fig07/curves.
        markers: Computations of independent transients, drawn as markers.
        where: Parameters that the drawn cases have; a list allows several values.
        by: The parameter that tells the lines apart.
        y: Columns, or the name of a field.
        d: Distance of the fields [D_c]; 0: the last time of a run.
        window: Ranges of both axes: x from and to, y from and to.
        in_G_p: Whether the field is that in the particles, in units of G_p and with colours of its own; else it is
            that in the liquid, with the same colours in all panels.
    """

    kind: str
    of: Sequence[str]
    markers: Sequence[str] = ()
    where: dict[str, Any] = field(default_factory=dict)
    by: str = ""
    y: Sequence[str] = ("dU",)
    d: float = 0.0
    window: Sequence[float] = ()
    in_G_p: bool = False

    def cases(self, results: Cases) -> list[Case]:
        """What is drawn, in ascending order of `by`."""
        found = [case for name in (*self.of, *self.markers) for case in results.of(name, self.where)]
        if not found:
            raise NotComputed(" ".join(self.of))
        return sorted(found, key=lambda case: case.parameters[self.by]) if self.by else found


@printing()
def draw(panels: Sequence[Panel], results: Cases, page: Page, folder: Path, name: str) -> list[Path]:
    """Draw a figure and write its files into a folder, in which the meshes are that it shows.

    Raises:
        NotComputed: One of its panels has nothing to show.
    """
    kind = panels[0].kind
    if kind == "fields":
        figure, axes = draw_fields(panels, results, page)
    else:
        width = page.width if len(panels) > 1 else min(page.width, NARROW)
        columns = 1 if kind in HEIGHTS else min(2, len(panels))
        figure, axes = page.panels(len(panels), HEIGHTS.get(kind, 0) * width or 56, 16, columns)
        drawn = zip(axes, panels, strict=True)
        if kind == "mesh":
            legends = [draw_mesh(axis, panel, folder) for axis, panel in drawn]
        else:
            legends = [draw_lines(axis, panel, results) for axis, panel in drawn]
        if len({(panel.by, *panel.y) for panel in panels}) == 1:
            key(figure, list({handle.get_label(): handle for handle in chain(*legends)}.values()))
        else:
            for axis, handles in zip(axes, legends, strict=True):
                axis.legend(handles=by_rows(handles, 2), ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    for letter, axis, panel in zip(LETTERS, axes, panels, strict=False):
        if len(panels) > 1:
            words = [equation(key, value) for key, value in panel.where.items() if not isinstance(value, list)]
            axis.set_title(f"({letter})  {', '.join(words)}", loc="left")
        if panel.window:
            axis.set(xlim=panel.window[:2], ylim=panel.window[2:])
    return page.save(figure, folder, name)


def pieces(panel: Panel, case: Case, name: str) -> Iterator[tuple[Any, Any, Any, bool]]:
    """What is drawn of a case: abscissas, ordinates, the half-widths of their intervals or None, whether as markers."""
    if panel.kind == "shapes":
        lines = outlines(case.frame(panel.d))
        middle = (lines[0][0, 0] + lines[-1][-1, 0]) / 2
        for line in lines:
            z, r = np.vstack([line, (line * [1, -1])[::-1]]).T
            yield z - middle, r, None, False
    elif panel.kind == "runs":
        yield case.table["t"], case.table[name], None, False
    elif case.kind == "run":  # a transient beside the curves
        yield case.last("d"), case.last(name), None, True
    elif case.kind == "critical":
        for _, branch in case.table.groupby("branch"):
            yield branch["Ca_e"], branch["d_cr"], None, False
        wanted = case.table[case.table["kind"] == "wanted"]
        yield wanted["Ca_e"], wanted["d_cr"], wanted["d_error"], True
    elif panel.kind == "critical":  # the curve of a rigid pair
        yield 0, distances([case])[0][0], None, True
    elif len(case.d) > 1:
        d = fine_distances(case.d)
        values, error = case.result.curve(d) if name == "dU" else (case.at(name, d), None)
        yield d, values, error, False


def draw_lines(axis: Axes, panel: Panel, results: Cases) -> list[Line2D]:
    """Lines and markers of a panel, with a look for each value of `by` and each column; returns its legend."""
    cases, handles = panel.cases(results), []
    values = dict.fromkeys(case.parameters[panel.by] for case in cases)
    for number, (value, name) in enumerate(product(values, panel.y)):
        line: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "linestyle": LINES[number % len(LINES)]}
        marker = line | {"marker": MARKERS[number], "markerfacecolor": "white"}
        for case in (case for case in cases if case.parameters[panel.by] == value):
            for x, y, error, as_markers in pieces(panel, case, name):
                if as_markers:
                    axis.errorbar(x, y, yerr=error, zorder=4, **marker | {"linestyle": ""})
                    continue
                axis.plot(x, y, **line)
                if error is not None:
                    fill(axis, x, y, error, line["color"])
        words = [f"${SHARED.column(name).symbol}$"] * (len(panel.y) > 1) + [equation(panel.by, value)] * (
            len(values) > 1
        )
        marked = panel.markers or panel.kind == "critical"
        handles.append(Line2D([], [], label=", ".join(words), **marker if marked else line))
    if panel.kind == "shapes":
        axis.set(aspect="equal", xlabel=LABELS[0], ylabel=LABELS[1])
    else:
        drawn = [np.asarray(line.get_ydata()) for line in axis.get_lines()]
        finish(axis, Units().axis_label([AXES[panel.kind]]), Units().axis_label([*map(SHARED.column, panel.y)]), drawn)
    return handles


def draw_mesh(axis: Axes, panel: Panel, folder: Path) -> list[Line2D]:
    """A mesh around the particles, half of the section; `NotComputed` without its file."""
    path = folder / f"{panel.of[0]}.vtu"
    if not path.is_file():
        raise NotComputed(str(path))
    mesh = meshio.read(path)
    region, cells = mesh.cell_data["region"][0], mesh.cells_dict["triangle6"]
    outline = mesh.points[cells[:, [0, 3, 1, 4, 2, 5]], :2]
    for part, face in ((region == 0, "white"), (region > 0, COLOURS[1])):
        axis.add_collection(PolyCollection(outline[part], facecolor=face, edgecolor="0.3", linewidth=0.25))
    reach = float(np.abs(outline[region > 0, :, 0]).max()) + 0.2
    axis.set(xlim=(-reach, reach), ylim=(0, 0.5), aspect="equal", xlabel=LABELS[0], ylabel=LABELS[1])
    axis.grid(visible=False)
    return []


def draw_fields(panels: Sequence[Panel], results: Cases, page: Page) -> tuple[Figure, list[Axes]]:
    """A field of several cases around the particles."""
    cases, (name, *_), own = [panel.cases(results)[0] for panel in panels], panels[0].y, panels[0].in_G_p
    views = views_of([case.frame(panel.d) for case, panel in zip(cases, panels, strict=True)], Units(), curve=True)
    layers = [layer_of(name, views, Units())]
    if own:
        values = [case.parameters["Ca_e"] * each for case, each in zip(cases, layers[0].values, strict=True)]
        layer = replace(layers[0], values=values, liquid=False)
        labels = [rf"({letter})  ${FIELDS[name].symbol}\ [G_p]$" for letter in LETTERS[: len(views)]]
        layers = [replace(layer, label=label) for label in labels]
        points = [np.vstack(view.particles) for view in views]
        windows: Any = [np.stack([each.min(axis=0) - MARGIN, each.max(axis=0) + MARGIN]).T.ravel() for each in points]
        views = [replace(view, window=window) for view, window in zip(views, windows, strict=True)]
    figure, axes, scaled = sheet(page, views, layers, len(views))
    for place, (axis, view) in enumerate(zip(axes, views, strict=True)):
        if own:
            scaled[place][1].set_norm(scale_of(replace(layer, values=[layer.values[place]]), [view]).norm)
        draw_view(axis, view, place, [scaled[place if own else 0]])
        axis.set(ylim=view.window[2:], yticks=[-0.2, 0, 0.2] if own else [-0.5, 0, 0.5])
    return figure, axes

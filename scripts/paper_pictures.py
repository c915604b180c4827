"""Pictures of the figures of configs/paper, in the style of pairsim's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from paper_results import Curve, Figure, NotComputed, Panel, Results, listed

from pairsim.plots.axes import finish, key, spread
from pairsim.plots.field_values import FIELDS
from pairsim.plots.labels import axis_label, equation, shown
from pairsim.plots.lines import BAND, fill
from pairsim.plots.meridional_section import outlines
from pairsim.plots.sections import Layer, View, add_bar, draw_view, layer_of, scale_of, views_of
from pairsim.plots.style import COLOURS, LINES, MARKERS, Page, printing
from pairsim.results.columns import LENGTH, STRESS
from pairsim.results.xdmf import FieldFrame

WIDTHS = (85, 170)
"""Widths of the pictures: one and two columns of a journal [mm]."""
NAMES = {"time.tol": r"$\mathrm{tol}$", "accuracy": "accuracy"}
SYMBOL = 3.8  # size of a marker, points
MARGIN = 0.06  # around the particles, where the liquid is not of interest [D_c]
LETTERS = "abcdefgh"
TICKS: dict[str, Any] = {"nbins": 6, "steps": [1, 2, 5, 10]}  # intervals of an axis, at most, and their lengths


def draw(name: str, figure: Figure, results: Results, folder: Path) -> list[Path]:
    """Draw a figure in both widths as PDF and PNG.

    Args:
        name: Its name, such as fig07.
        figure: Its description.
        results: What it shows.
        folder: Where to.

    Returns:
        The files.

    Raises:
        NotComputed: One of its panels has nothing to show.
    """
    written = []
    for width in WIDTHS:
        page = Page(("png", "pdf"), float(width))
        written += page.save(canvas_of(figure, results, page), folder, f"{name}-{width}mm")
    return written


@printing()
def canvas_of(figure: Figure, results: Results, page: Page) -> Canvas:
    """The drawn figure."""
    kind = figure.panels[0].kind
    if kind == "fields":
        return _draw_fields(figure.panels, results, page)
    if kind in ("shapes", "mesh"):
        count = len(figure.panels)
        canvas = page.figure((0.44 if kind == "shapes" else 0.32) * page.width * count + 14)
        axes = list(canvas.subplots(count, 1, squeeze=False)[:, 0])
    else:
        canvas, axes = page.panels(len(figure.panels), height=56, extra=12)
    shown_cases = [case for panel in figure.panels for name in panel.of for case in results.cases(name, panel.where)]
    values = _values(shown_cases, figure.panels[0].by)
    handles: dict[str, Any] = {}
    alike = len({panel.by for panel in figure.panels}) == 1
    for place, (axis, panel) in enumerate(zip(axes, figure.panels, strict=True)):
        drawn = PANELS[kind](axis, panel, results, values)
        if len(panel.y) > 1 or not alike:
            axis.legend(handles=drawn, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
        else:
            handles |= {entry.get_label(): entry for entry in drawn}
        if len(figure.panels) > 1:
            axis.set_title(f"({LETTERS[place]})  {_where(panel)}", loc="left")
    if handles:
        key(canvas, list(handles.values()))
    return canvas


def _where(panel: Panel) -> str:
    """The parameters of a panel, for its title."""
    fixed = {name: value for name, value in panel.where.items() if not isinstance(value, list)}
    return ", ".join(_equation(name, value) for name, value in fixed.items())


def _equation(name: str, value: Any) -> str:
    return f"{NAMES[name]} = {shown(value)}" if name in NAMES else equation(name, value)


def _values(cases: Sequence[Any], by: str) -> list[Any]:
    """The values of the parameter that tells lines apart, in ascending order."""
    found = {_value(case, by) for case in cases}
    return sorted(found)


def _placed(cases: Sequence[Any], by: str, known: list[Any]) -> list[tuple[int, Any]]:
    """The values of a panel with their places among those of the figure, or among its own where it has another key."""
    own = _values(cases, by)
    return [((known if set(own) <= set(known) else own).index(value), value) for value in own]


def _value(case: Any, by: str) -> Any:
    value = case.parameters.get(by)
    return value[0] if isinstance(value, list) else value


def _look(place: int, **more: Any) -> dict[str, Any]:
    return {"color": COLOURS[place % len(COLOURS)], "linestyle": LINES[place // 4 % len(LINES)]} | more


def _shown_cases(panel: Panel, results: Results, names: Sequence[str]) -> list[Any]:
    found = [case for name in names for case in results.cases(name, panel.where)]
    if not found and names:
        raise NotComputed(" ".join(names))
    return found


def _draw_curves(axis: Axes, panel: Panel, results: Results, values: list[Any]) -> list[Line2D]:
    """Curves with their bands, and transients as markers: dU at the distance that they have reached."""
    curves = [case for case in _shown_cases(panel, results, panel.of) if len(case.d) > 1]
    markers = [case for name in panel.markers for case in results.cases(name, panel.where)]
    handles = []
    for place, value in _placed(curves, panel.by, values):
        face = _look(place)
        symbols = MARKERS[place]
        for number, column in enumerate(panel.y):
            look = face if len(panel.y) == 1 else _look(number)
            for case in (case for case in curves if _value(case, panel.by) == value):
                _draw_curve(axis, case, column, look)
            for case in (case for case in markers if _value(case, panel.by) == value):
                axis.plot(
                    [case.last("d")],
                    [case.last(column)],
                    MARKERS[number] if len(panel.y) > 1 else symbols,
                    color=look["color"],
                    markerfacecolor="white",
                    markersize=SYMBOL,
                    zorder=4,
                )
            if len(panel.y) > 1:
                more: dict[str, Any] = {"marker": MARKERS[number], "markerfacecolor": "white"}
                handles.append(Line2D([], [], label=axis_label([column]).split("  ")[0], **look, **more))
        if len(panel.y) == 1:
            marks: dict[str, Any] = {"marker": symbols, "markerfacecolor": "white"} if markers else {}
            handles.append(Line2D([], [], label=_equation(panel.by, value), **face, **marks))
    seen = [case.table[column] for case in curves for column in panel.y]
    spread(axis, "x", [float(d) for case in curves for d in case.d])
    finish(axis, axis_label(["d"]), axis_label(list(panel.y)), seen)
    axis.yaxis.set_major_locator(MaxNLocator(**TICKS))
    if panel.window:
        axis.set(xlim=panel.window[:2], ylim=panel.window[2:])
    return handles


def _draw_curve(axis: Axes, case: Curve, column: str, look: dict[str, Any]) -> None:
    fine, values, error = case.line.smooth()
    if column != "dU":
        values, error = case.at(column, fine), None
    axis.plot(fine, values, **look)
    if error is not None:
        fill(axis, fine, values, error, {**look, "band": BAND})


def _draw_runs(axis: Axes, panel: Panel, results: Results, values: list[Any]) -> list[Line2D]:
    """Columns against time."""
    runs = _shown_cases(panel, results, panel.of)
    handles = []
    for place, value in _placed(runs, panel.by, values):
        for case in (case for case in runs if _value(case, panel.by) == value):
            for number, column in enumerate(panel.y):
                # With a single column, lines on top of each other are told apart by their styles.
                look = _look(place, linestyle=LINES[(place if len(panel.y) == 1 else number) % len(LINES)])
                axis.plot(case.table["t"], case.table[column], **look)
                if len(panel.y) > 1:
                    label = f"{axis_label([column]).split('  ')[0]}, {_equation(panel.by, value)}"
                    handles.append(Line2D([], [], label=label, **look))
        if len(panel.y) == 1:
            handles.append(Line2D([], [], label=_equation(panel.by, value), **look))
    seen = [case.table[column] for case in runs for column in panel.y]
    finish(axis, axis_label(["t"]), axis_label(list(panel.y)), seen)
    return handles


def _draw_critical(axis: Axes, panel: Panel, results: Results, values: list[Any]) -> list[Line2D]:
    """Critical distances over Ca_e, with the zeros of rigid pairs at Ca_e = 0."""
    cases = _shown_cases(panel, results, panel.of)
    handles = []
    for place, value in _placed(cases, panel.by, values):
        look = _look(place)
        handles.append(
            Line2D([], [], label=_equation(panel.by, value), marker=MARKERS[place], markerfacecolor="white", **look)
        )
        for case in (case for case in cases if _value(case, panel.by) == value):
            if isinstance(case, Curve):
                zeros = [zero.d for zero in case.zeros if not zero.stable][:1]
                axis.plot([0] * len(zeros), zeros, MARKERS[place], color=look["color"], clip_on=False, zorder=5)
                continue
            rows = case.rows
            for branch in dict.fromkeys(row["branch"] for row in rows):
                part = [row for row in rows if row["branch"] == branch]
                axis.plot([row["Ca_e"] for row in part], [row["d_cr"] for row in part], **look)
            wanted = [row for row in rows if row["kind"] == "wanted"]
            axis.errorbar(
                [row["Ca_e"] for row in wanted],
                [row["d_cr"] for row in wanted],
                yerr=[row["d_error"] for row in wanted],
                fmt=MARKERS[place],
                color=look["color"],
                markersize=SYMBOL,
                markerfacecolor="white",
            )
    axis.set_xlim(left=0)
    axis.set_ylim(bottom=0)
    finish(axis, axis_label(["Ca_e"]), axis_label(["d_cr"]), [])
    return handles


def _closed(frame: FieldFrame) -> list[Any]:
    """Outlines of the particles, closed, about the middle of the gap, or about the centre of a single one."""
    lines = outlines(frame)
    ends = [(line[0, 0], line[-1, 0]) for line in lines]
    middle = (ends[0][1] + ends[1][0]) / 2 if len(ends) == 2 else sum(ends[0]) / 2
    return [np.vstack([line, (line * [1, -1])[::-1]]) - [middle, 0] for line in lines]


def _draw_shapes(axis: Axes, panel: Panel, results: Results, values: list[Any]) -> list[Line2D]:
    """Outlines over each other."""
    cases = _shown_cases(panel, results, panel.of)
    handles = []
    for place, value in _placed(cases, panel.by, values):
        look = _look(place, linestyle=LINES[place % len(LINES)])  # so that lines on top of each other are seen
        for case in (case for case in cases if _value(case, panel.by) == value):
            for line in _closed(case.frame(panel.d)):
                axis.plot(*line.T, **look, linewidth=0.8)
        handles.append(Line2D([], [], label=_equation(panel.by, value), **look))
    axis.set(aspect="equal", xlabel=rf"$z\ [{LENGTH}]$", ylabel=rf"$r\ [{LENGTH}]$")
    axis.xaxis.set_major_locator(MaxNLocator(**TICKS))
    return handles


def _draw_mesh(axis: Axes, panel: Panel, results: Results, _: list[Any]) -> list[Line2D]:
    """A mesh around the particles, half of the section."""
    import meshio

    path = results.output / f"{panel.of[0]}.vtu"
    if not path.is_file():
        raise NotComputed(str(path))
    mesh = meshio.read(path)
    region, cells = mesh.cell_data["region"][0], mesh.cells_dict["triangle6"]
    outline = mesh.points[cells[:, [0, 3, 1, 4, 2, 5]], :2]
    for part, face in ((region == 0, "white"), (region > 0, COLOURS[1])):
        axis.add_collection(PolyCollection(outline[part], facecolor=face, edgecolor="0.3", linewidth=0.25))
    reach = float(np.abs(outline[region > 0, :, 0]).max()) + 0.2
    window = panel.window or (-reach, reach, 0, 0.5)
    axis.set(xlim=window[:2], ylim=window[2:], aspect="equal")
    axis.set(xlabel=rf"$z\ [{LENGTH}]$", ylabel=rf"$r\ [{LENGTH}]$")
    axis.xaxis.set_major_locator(MaxNLocator(**TICKS))
    axis.grid(visible=False)
    return []


def _draw_fields(panels: Sequence[Panel], results: Results, page: Page) -> Canvas:
    """A field of several cases, beside each other where there is room, with the same colours or a scale for each."""
    cases = [_shown_cases(panel, results, panel.of)[0] for panel in panels]
    views = views_of([case.frame(panel.d) for case, panel in zip(cases, panels, strict=True)])
    layers = [_layer(panel, case, view) for panel, case, view in zip(panels, cases, views, strict=True)]
    if not layers[0].liquid:
        views = _closer(views)
    columns = 1 if page.narrow else len(panels)
    z0, z1, r0, r1 = views[0].window
    height = (page.width / columns - 14) * (r1 - r0) / (z1 - z0) + (26 if panels[0].own_scale else 13)
    canvas = page.figure(height * len(panels) / columns + (0 if panels[0].own_scale else 16))
    axes = list(canvas.subplots(len(panels) // columns, columns, squeeze=False).flat)
    together = Layer([layer.values[0] for layer in layers], layers[0].label, layers[0].liquid, layers[0].solid, True)
    common = scale_of(together, views)
    for place, (axis, view, layer, panel) in enumerate(zip(axes, views, layers, panels, strict=True)):
        scale = scale_of(layer, [view]) if panel.own_scale else common
        draw_view(axis, view, 0, [(layer, scale)])
        axis.set_ylim(view.window[2:])  # draw_view's ticks widen it
        axis.yaxis.set_major_locator(MaxNLocator(**TICKS))
        axis.set_title(f"({LETTERS[place]})  {_where(panel)}", loc="left")
        axis.set_xlabel(rf"$z\ [{LENGTH}]$")
        if panel.own_scale:
            add_bar(canvas, [axis], layer, scale)
    if not panels[0].own_scale:
        add_bar(canvas, axes, together, common)
    return canvas


def _layer(panel: Panel, case: Any, view: View) -> Layer:
    """The field of a panel: in the liquid, or in the particles in units of G_p."""
    name = panel.y[0]
    values = layer_of(name, FIELDS[name], [view]).values[0]
    if not panel.in_G_p:
        return Layer([values], FIELDS[name].label, liquid=True, solid=False, diverging=True)
    scaled = values * max(listed(case.parameters["Ca_e"]))
    return Layer([scaled], FIELDS[name].label.replace(STRESS, "G_p"), liquid=False, solid=True, diverging=True)


def _closer(views: Sequence[View]) -> list[View]:
    """The same without most of the liquid, in windows of one size around the particles."""
    every = [np.vstack(view.particles) for view in views]
    half = max(float(np.ptp(points[:, 0])) / 2 for points in every) + MARGIN
    reach = max(float(points[:, 1].max()) for points in every) + MARGIN
    middles = [float(points[:, 0].min() + points[:, 0].max()) / 2 for points in every]
    windows = [(middle - half, middle + half, -reach, reach) for middle in middles]
    return [replace(view, window=window) for view, window in zip(views, windows, strict=True)]


PANELS: dict[str, Any] = {
    "curves": _draw_curves,
    "runs": _draw_runs,
    "critical": _draw_critical,
    "shapes": _draw_shapes,
    "mesh": _draw_mesh,
}

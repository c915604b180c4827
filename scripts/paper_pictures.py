"""Pictures of the figures of configs/paper: panels of lines, outlines, meshes or fields."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib as mpl
import meshio
import numpy as np
from book.cases import Case, Cases, NotComputed, first
from book.fields import outlines, quarters, regions
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

from pairsim.plots.axes import by_rows
from pairsim.plots.style import COLOURS, LINES, MARKERS, MM, PRINT, Page
from pairsim.results.columns import column

WIDTHS = (85, 170)
"""Widths of the pictures: one and two columns of a journal [mm]."""
NAMES = {"time.tol": r"\mathrm{tol}", "accuracy": r"\mathrm{accuracy}", "mesh.Np": "N_p", "beta": r"\beta"}
NAMES |= {"De": r"\mathrm{De}", "Ca_e": r"\mathrm{Ca}_e"}
FIELDS = {
    "tau_zz": ("tau_s_zz", r"$\tau_{zz}\ [G_p]$"),
    "tau_zz_extra": ("tau_p_zz_extra", r"$\tau_{zz} - \tau_{zz}^0\ [\eta_0 U_{av}/D_c]$"),
    "pressure_extra": ("pressure_extra", r"$p - p^0\ [\eta_0 U_{av}/D_c]$"),
}
"""Fields by name: the array, and its label."""
AXES = (r"$z\ [D_c]$", r"$r\ [D_c]$")
MARGIN = 0.06  # around the particles, where the liquid is not of interest [D_c]
TICKS: dict[str, Any] = {"nbins": 6, "steps": [1, 2, 5, 10]}  # intervals of an axis, at most, and their lengths


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
        in_G_p: Whether the field is that in the particles, in units of G_p; else it is that in the liquid.
        own_scale: Whether a field has colours of its own, not those of the other panels.
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
    own_scale: bool = False

    def cases(self, results: Cases) -> list[Case]:
        """What is drawn, in ascending order of `by`."""
        found = [case for name in self.of for case in results.of(name, self.where)]
        if not found:
            raise NotComputed(" ".join(self.of))
        return sorted(found, key=self.value) if self.by else found

    def value(self, case: Case) -> Any:
        """The value of `by`."""
        return first(case.parameters.get(self.by))

    @property
    def title(self) -> str:
        """What all of its cases have."""
        return ", ".join(equation(key, value) for key, value in self.where.items() if not isinstance(value, list))


def equation(key: str, value: Any) -> str:
    """A parameter with its value."""
    shown = f"{value:g}" if isinstance(value, int | float) else str(value).replace("%", r"\%")
    return rf"${NAMES[key]} = {shown}$"


def symbol(names: Sequence[str], unit: bool = True) -> str:
    """Columns on an axis, with their unit."""
    entries = [column(name) for name in names]
    text = ", ".join(f"${entry.symbol}$" for entry in entries)
    return f"{text}  [${entries[0].unit or '-'}$]" if unit else text


def draw(panels: Sequence[Panel], results: Cases, page: Page, folder: Path, name: str) -> list[Path]:
    """Draw a figure and write its files.

    Raises:
        NotComputed: One of its panels has nothing to show.
    """
    with mpl.rc_context(PRINT):
        columns = 1 if page.narrow or panels[0].kind in ("shapes", "mesh") else min(2, len(panels))
        rows = -(-len(panels) // columns)
        height = {"shapes": 0.44, "mesh": 0.32, "fields": 0.62}.get(panels[0].kind, 0.0) * page.width / columns
        canvas = Canvas(figsize=(page.width * MM, (rows * (height or 56) + 16) * MM), layout="constrained")
        axes = list(canvas.subplots(rows, columns, squeeze=False).flat)
        for unused in axes[len(panels) :]:
            unused.remove()
        if panels[0].kind == "fields":
            draw_fields(canvas, axes, panels, results)
        else:
            draw_lines(canvas, axes, panels, results)
        for letter, axis, panel in zip("abcdefgh", axes, panels, strict=False):
            if len(panels) > 1:
                axis.set_title(f"({letter})  {panel.title}", loc="left")
            if panel.window:
                axis.set(xlim=panel.window[:2], ylim=panel.window[2:])
            axis.xaxis.set_major_locator(MaxNLocator(**TICKS))
        return page.save(canvas, folder, name)


def draw_lines(canvas: Canvas, axes: Sequence[Axes], panels: Sequence[Panel], results: Cases) -> None:
    """Panels of lines; a key for all of them where they show the same, else one each."""
    handles: dict[Any, Line2D] = {}
    alike = len({(panel.by, len(panel.y) > 1) for panel in panels}) == 1
    for axis, panel in zip(axes, panels, strict=False):
        drawn = PANELS[panel.kind](axis, panel, results)
        if alike and len(panel.y) == 1:
            handles |= {handle.get_label(): handle for handle in drawn}
        elif drawn:
            axis.legend(handles=by_rows(drawn, 2), ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    if handles:
        columns = min(len(handles), 4)
        canvas.legend(handles=by_rows(list(handles.values()), columns), loc="outside upper center", ncols=columns)


def look(place: int, style: int = 0) -> dict[str, Any]:
    """Colour and style of a line, and the face of its marker."""
    return {"color": COLOURS[place % len(COLOURS)], "linestyle": LINES[style % 4], "markerfacecolor": "white"}


def places(cases: Sequence[Case], panel: Panel) -> dict[Any, int]:
    """Numbers of the values of `by`."""
    return {value: number for number, value in enumerate(dict.fromkeys(map(panel.value, cases)))}


def draw_table(axis: Axes, panel: Panel, results: Cases) -> list[Line2D]:
    """Columns of curves over the distance, with their bands, or of runs over the time."""
    cases = [case for case in panel.cases(results) if len(case.table) > 1]
    place, x = places(cases, panel), "d" if panel.kind == "curves" else "t"
    handles: dict[str, Line2D] = {}
    for case in cases:
        for number, name in enumerate(panel.y):
            by_column = len(panel.y) > 1 and len(place) == 1
            own = look(number if by_column else place[panel.value(case)], number if len(panel.y) > 1 else 0)
            at, values = case.column(x), case.column(name)
            if panel.kind == "curves":
                at = np.clip(np.geomspace(at[0], at[-1], 300), at[0], at[-1])
                if name == "dU":
                    values, error = case.result.curve(at)
                    axis.fill_between(at, values - error, values + error, color=own["color"], alpha=0.25, lw=0)
                else:
                    values = case.at(name, at)
            axis.plot(at, values, color=own["color"], linestyle=own["linestyle"])
            words = [] if len(panel.y) == 1 else [symbol([name], unit=False)]
            words += [] if by_column else [equation(panel.by, panel.value(case))]
            marker = MARKERS[number if by_column else place[panel.value(case)]] if panel.markers else ""
            handles[", ".join(words)] = Line2D([], [], marker=marker, label=", ".join(words), **own)
            same = {panel.by: panel.value(case)} if panel.by else {}
            for run in (run for each in panel.markers for run in results.of(each, panel.where | same)):
                axis.plot(run.last("d"), run.last(name), marker, **own, zorder=4)
    axis.set(xlabel=symbol([x]), ylabel=symbol(panel.y))
    axis.axhline(0, color="0.72", lw=0.6, zorder=0)
    return list(handles.values())


def draw_critical(axis: Axes, panel: Panel, results: Cases) -> list[Line2D]:
    """Critical distances over Ca_e, with the zeros of rigid pairs at Ca_e = 0."""
    cases = panel.cases(results)
    place, handles = places(cases, panel), {}
    for case in cases:
        number = place[panel.value(case)]
        own = look(number) | {"marker": MARKERS[number]}
        handles[number] = Line2D([], [], label=equation(panel.by, panel.value(case)), **own)
        if case.kind == "curve":
            axis.plot(0, case.zero(stable=False)[0], **own, clip_on=False, zorder=5)
            continue
        for _, branch in case.table.groupby("branch"):
            axis.plot(branch["Ca_e"], branch["d_cr"], color=own["color"])
        wanted = case.table[case.table["kind"] == "wanted"]
        axis.errorbar(wanted["Ca_e"], wanted["d_cr"], yerr=wanted["d_error"], **own | {"linestyle": ""})
    axis.set(xlabel=r"$\mathrm{Ca}_e$", ylabel=symbol(["d_cr"]))
    axis.set_xlim(left=0)
    axis.set_ylim(bottom=0)
    return list(handles.values())


def draw_shapes(axis: Axes, panel: Panel, results: Cases) -> list[Line2D]:
    """Outlines over each other, about the middle of the particles."""
    cases = panel.cases(results)
    place, handles = places(cases, panel), {}
    for case in cases:
        number = place[panel.value(case)]
        own = look(number, number)
        handles[number] = Line2D([], [], label=equation(panel.by, panel.value(case)), **own)
        fields = case.result.fields(panel.d or case.result.times[-1])
        lines = outlines(fields)
        middle = (lines[0][:, 0].min() + lines[-1][:, 0].max()) / 2
        for line in lines:
            z, r = np.vstack([line, (line * [1, -1])[::-1]]).T
            axis.plot(z - middle, r, lw=0.8, **own)
    axis.set(aspect="equal", xlabel=AXES[0], ylabel=AXES[1])
    return list(handles.values())


def draw_mesh(axis: Axes, panel: Panel, results: Cases) -> list[Line2D]:
    """A mesh around the particles, half of the section."""
    path = results.output / f"{panel.of[0]}.vtu"
    if not path.is_file():
        raise NotComputed(str(path))
    mesh = meshio.read(path)
    region, cells = mesh.cell_data["region"][0], mesh.cells_dict["triangle6"]
    outline = mesh.points[cells[:, [0, 3, 1, 4, 2, 5]], :2]
    for part, face in ((region == 0, "white"), (region > 0, COLOURS[1])):
        axis.add_collection(PolyCollection(outline[part], facecolor=face, edgecolor="0.3", linewidth=0.25))
    reach = float(np.abs(outline[region > 0, :, 0]).max()) + 0.2
    axis.set(xlim=(-reach, reach), ylim=(0, 0.5), aspect="equal", xlabel=AXES[0], ylabel=AXES[1])
    axis.grid(visible=False)
    return []


def draw_fields(canvas: Canvas, axes: Sequence[Axes], panels: Sequence[Panel], results: Cases) -> None:
    """A field of several cases around the particles, with the same colours or a scale for each."""
    shown = []
    for panel in panels:
        case = panel.cases(results)[0]
        grid = case.result.fields(panel.d)
        liquid, *particles = regions(grid)
        name, label = FIELDS[panel.y[0]]
        values = grid.point_data[name] * (first(case.parameters["Ca_e"]) if panel.in_G_p else 1.0)
        cells = np.vstack(particles) if panel.in_G_p else liquid
        nodes = grid.points[np.unique(np.vstack(particles))]
        half = np.ptp(nodes[:, 0]) / 2 + (MARGIN if panel.in_G_p else 0.3)
        middle = (nodes[:, 0].min() + nodes[:, 0].max()) / 2
        near = np.abs(grid.points[np.unique(cells), 0] - middle) < half
        shown.append((grid, cells, values, middle, half, np.abs(values[np.unique(cells)][near]).max(), label))
    for axis, panel, (grid, cells, values, middle, half, own, label) in zip(axes, panels, shown, strict=True):
        top = own if panel.own_scale else max(each[5] for each in shown)
        z, r = grid.points[:, 0] - middle, grid.points[:, 1]
        look: Any = {"shading": "gouraud", "cmap": "RdBu_r", "vmin": -top, "vmax": top, "rasterized": True}
        for side in (1, -1):  # both halves of the section
            image = axis.tripcolor(Triangulation(z, side * r, quarters(cells)), values, **look)
            for line in outlines(grid):
                axis.plot(line[:, 0] - middle, side * line[:, 1], color="0.2", lw=0.6)
        reach = float(max(line[:, 1].max() for line in outlines(grid))) + MARGIN if panel.in_G_p else 0.5
        axis.set(aspect="equal", xlim=(-half, half), ylim=(-reach, reach), xlabel=AXES[0], ylabel=AXES[1])
        if panel.own_scale or panel is panels[-1]:
            where = axis if panel.own_scale else list(axes)
            canvas.colorbar(image, ax=where, location="bottom", label=label, aspect=40, shrink=0.6)


PANELS: dict[str, Any] = {
    "curves": draw_table,
    "runs": draw_table,
    "critical": draw_critical,
    "shapes": draw_shapes,
    "mesh": draw_mesh,
}

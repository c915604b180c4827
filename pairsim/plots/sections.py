"""The meridional section around the particles: any field, its colours and what is drawn over them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import LinearNDInterpolator

from pairsim.physics import declared
from pairsim.plots.frames import FIELDS, axial_velocity, outlines, particle_velocity
from pairsim.plots.labels import tex_number
from pairsim.plots.style import DIVERGING, GREY, SEQUENTIAL, Look, Page, colour_bar
from pairsim.plots.units import Units
from pairsim.quantities.kinds import LENGTH, TIME
from pairsim.record.xdmf import FieldFrame
from pairsim.runtime.arrays import Array, Indices

PIECES = [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
"""The straight triangles between the nodes of a cell (VTK's order)."""
LEAST_HALF = 1.5  # half the length of tube that is shown, over its radius, at least
OUTLIERS = 0.995  # part of the values that a scale covers: stresses peak at the poles
STEEP = 30.0  # ratio of the values of a positive field from which its scale is logarithmic
GRID = 361, 91  # points along the tube and across half of it, for streamlines
INWARD, OUTWARD = 7, 9  # streamlines that go with the particles or faster, and slower
LONG = 3.0  # ratio of length to height from which views lie below each other
# Heights of a colour bar, of the labels below an axis, of a title, and of the small print [mm].
BAR, LABELS, TITLE, PRINT = 2.5, 9.5, 10.0, 5.0


@dataclass(frozen=True)
class View:
    """The part of one frame that is drawn."""

    frame: FieldFrame  # the frame, with coordinates in the unit that is drawn
    window: tuple[float, float, float, float]  # z from and to, r from and to
    particles: tuple[Array, ...]  # their closed outlines
    title: str  # the time of a frame of a run, or the distance of one of a curve
    unit: str  # of the coordinates

    def label(self, coordinate: str) -> str:
        return f"${coordinate}$  [{self.unit}]"

    @property
    def wall(self) -> float:
        """The radius of the tube."""
        return float(self.frame.points[:, 1].max())


@dataclass(frozen=True)
class Layer:
    """Values in the liquid or in the particles of each view, with their colours."""

    values: Sequence[Array]  # at the nodes of each view's frame
    label: str  # of the colour bar
    liquid: bool  # whether it is drawn in the liquid
    solid: bool  # whether it is drawn in the particles
    diverging: bool  # whether colours are centred on zero
    lines: bool = False  # whether streamlines are drawn over it
    sides: tuple[int, ...] = (1, -1)  # where it is drawn: above the axis (1), below it (-1), or on both sides

    def cells(self, view: View) -> Iterator[tuple[bool, Indices]]:
        """The cells of a view in which it is drawn: for each phase, whether it is the particles, and its cells."""
        z = view.frame.points[view.frame.cells, 0]
        seen = (z.max(axis=1) > view.window[0]) & (z.min(axis=1) < view.window[1])
        for solid, drawn in ((False, self.liquid), (True, self.solid)):
            chosen = seen & ((view.frame.region > 0) == solid)
            if drawn and chosen.any():
                yield solid, view.frame.cells[chosen]


def views_of(frames: Sequence[FieldFrame], units: Units, curve: bool) -> list[View]:
    """Views of frames of a curve or a run, in windows of the same length, each centred on the particles."""
    symbol, of = ("d", LENGTH) if curve else ("t", TIME)
    views = []
    for each in frames:
        frame = replace(each, points=each.points * units.factor(LENGTH))
        particles = tuple(np.vstack([line, (line * [1, -1])[::-1]]) for line in outlines(frame))
        z = [line[:, 0] for line in particles] or [np.full(1, frame.points[:, 0].mean())]
        wall = float(frame.points[:, 1].max())
        margin = max(map(np.ptp, z)) if particles else 2 * wall
        window = float(min(map(np.min, z)) - margin), float(max(map(np.max, z)) + margin), -1.04 * wall, 1.04 * wall
        title = f"${symbol} = {tex_number(each.t * units.factor(of))}$ {units.name(of)}"
        views.append(View(frame, window, particles, title, units.name(LENGTH)))
    half = max(LEAST_HALF * views[0].wall, *((view.window[1] - view.window[0]) / 2 for view in views))
    middles = [(view.window[0] + view.window[1]) / 2 for view in views]
    windows = [(z - half, z + half, *view.window[2:]) for z, view in zip(middles, views, strict=True)]
    return [replace(view, window=window) for view, window in zip(views, windows, strict=True)]


def layer_of(name: str, views: Sequence[View], units: Units) -> Layer:
    """A field as a layer, in the liquid and, where they have it, in the particles."""
    field, data = FIELDS[name], views[-1].frame.point_data
    values = [field.values(view.frame) * units.factor(field.unit) for view in views]
    label = f"${field.symbol}$  [{units.name(field.unit)}]"
    return Layer(values, label, field.liquid in data, field.solid in data, field.diverging, lines=name == "streamlines")


def scale_of(layer: Layer, views: Sequence[View]) -> ScalarMappable:
    """Colours of a layer, the same in all views; outliers do not set the range."""
    pairs = zip(views, layer.values, strict=True)
    found = [values[cells].ravel() for view, values in pairs for _, cells in layer.cells(view)]
    every = np.concatenate(found) if found else np.zeros(1)
    if layer.diverging:
        reach = float(np.quantile(np.abs(every), OUTLIERS)) or 1.0
        return ScalarMappable(Normalize(-reach, reach), DIVERGING)
    low, high = float(every.min()), float(np.quantile(every, OUTLIERS))
    high = high if high > low else low + 1.0
    norm = LogNorm(low, high) if low > 0 and high / low > STEEP else Normalize(low, high)
    return ScalarMappable(norm, SEQUENTIAL)


def draw_view(axis: Axes, view: View, place: int, layers: Sequence[tuple[Layer, ScalarMappable]]) -> None:
    """Draw one view, with the index `place` in the layers; particles without colours are grey."""
    z, r = view.frame.points.T
    line: Look = {"color": "black", "linestyle": "-"}
    coloured = False
    for layer, scale in layers:
        for solid, cells in layer.cells(view):
            coloured |= solid
            # Particles lie over the axis and over streamlines.
            look: Any = {"cmap": scale.cmap, "norm": scale.norm, "rasterized": True, "zorder": 1.6 if solid else 1}
            for side in layer.sides:
                pieces = Triangulation(z, side * r, cells[:, PIECES].reshape(-1, 3))
                axis.tripcolor(pieces, layer.values[place], shading="gouraud", **look)
        if layer.lines:
            _streamlines(axis, view)
    _levels(axis, view)
    for outline in view.particles:
        if not coloured:
            axis.fill(*outline.T, color=GREY, linewidth=0, zorder=2)
        axis.plot(*outline.T, linewidth=0.7, zorder=3, **line)
    for wall in (view.wall, -view.wall):
        axis.plot(view.window[:2], [wall, wall], linewidth=0.9, zorder=3, **line)
    if any(layer.sides != (1, -1) for layer, _ in layers):
        axis.axhline(0, linewidth=0.4, zorder=1.5, **line)
    axis.set(xlim=view.window[:2], ylim=view.window[2:], aspect="equal", ylabel=view.label("r"))
    axis.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axis.set_yticks([-view.wall, 0.0, view.wall])
    axis.grid(visible=False)


def mark_view(axis: Axes, view: View) -> None:
    """Add a title, the direction of the flow, and names of particles: T, L of a pair, else numbers from upstream."""
    axis.set_title(view.title)
    outlined, corner = [withStroke(linewidth=1.6, foreground="white")], axis.transAxes
    flow = r"flow $\rightarrow$"
    axis.text(0.015, 0.955, flow, transform=corner, va="top", fontsize=7, zorder=4, path_effects=outlined)
    count = len(view.particles)
    names = "TL" if count == 2 else [str(i) for i in range(1, count + 1)] if count > 2 else []
    for name, outline in zip(names, view.particles, strict=False):
        z = float(outline[:, 0].min() + outline[:, 0].max()) / 2
        axis.text(z, 0, name, ha="center", va="center", zorder=4, path_effects=outlined)


def _levels(axis: Axes, view: View) -> None:
    """The contours of what laws add, such as where the liquid begins to yield."""
    (z, r), liquid = view.frame.points.T, view.frame.cells[view.frame.region == 0]
    for name, field in declared.FIELDS.items():
        values = view.frame.point_data.get(name)
        if values is None or field.level is None or not values[liquid].min() < field.level < values[liquid].max():
            continue
        for side in (1, -1):
            pieces = Triangulation(z, side * r, liquid[:, PIECES].reshape(-1, 3))
            axis.tricontour(pieces, values, levels=[field.level], colors="black", linewidths=0.8, linestyles="dashed")


def _streamlines(axis: Axes, view: View) -> None:
    """Contours of the stream function psi, d psi/dr = r (u_z - U), in the frame of the particles."""
    points, first = np.unique(view.frame.points.round(9), axis=0, return_index=True)
    z, r = np.linspace(*view.window[:2], GRID[0]), np.linspace(0, view.wall, GRID[1])
    # The velocity is continuous, and that of a rigid particle is the same all over its surface: cells are not needed.
    velocity = LinearNDInterpolator(points, axial_velocity(view.frame)[first] - particle_velocity(view.frame))
    grid = np.meshgrid(z, r)
    psi = cumulative_trapezoid(np.nan_to_num(velocity(*grid)) * r[:, None], r, axis=0, initial=0)
    places = np.column_stack([each.ravel() for each in grid])
    inside = np.zeros(len(places), dtype=bool)
    for outline in view.particles:
        inside |= Outline(outline).contains_points(places)
    inside = inside.reshape(psi.shape)
    # Particles that approach each other move in this frame: lines with smaller |psi| would end on their surfaces.
    near = float(np.abs(psi[inside]).max(initial=0.0))
    low, high = min(float(psi.min()), 0.0), max(float(psi.max()), 0.0)
    slow, fast = (np.linspace(0, 1, count + 1)[1:-1] for count in (OUTWARD, INWARD))
    levels = np.unique(np.concatenate([low * slow[::-1], high * fast**2]))
    outside, shown = np.ma.masked_array(psi, inside), levels[np.abs(levels) > near]
    for side in (1, -1):
        axis.contour(
            z, side * r, outside, levels=shown, colors="black", linewidths=0.45, linestyles="solid", zorder=1.5
        )


def sheet(
    page: Page, views: Sequence[View], layers: Sequence[Layer], count: int, first: int = 0
) -> tuple[Figure, list[Axes], list[tuple[Layer, ScalarMappable]]]:
    """A figure with panels for `count` views, two in a row where there is room, and the colour bars of layers below.

    The range of colours is that of the views from number `first` on, so that the start-up of a run does not set it.
    """
    z_min, z_max, r_min, r_max = views[0].window
    columns = 1 if page.narrow or count == 1 or z_max - z_min > LONG * (r_max - r_min) else 2
    abreast = 1 if page.narrow else len(layers)
    inner = (page.width / columns - 15) * (r_max - r_min) / (z_max - z_min)
    rows, bars = -(-count // columns), len(layers) // abreast
    figure = page.figure((inner + TITLE) * rows + (BAR + LABELS) * bars + LABELS + PRINT)
    across = math.lcm(columns, abreast)
    grid = figure.add_gridspec(rows + bars, across, height_ratios=[inner] * rows + [BAR] * bars)

    def place(row: int, number: int, in_a_row: int, **more: Any) -> Axes:
        wide, (below, right) = across // in_a_row, divmod(number, in_a_row)
        return figure.add_subplot(grid[row + below, right * wide : (right + 1) * wide], **more)

    axes = [place(0, i, columns) for i in range(count)]
    scaled = [(layer, scale_of(replace(layer, values=layer.values[first:]), views[first:])) for layer in layers]
    for axis in axes[-columns:]:
        axis.set_xlabel(views[0].label("z"))
    for i, (layer, scale) in enumerate(scaled):
        axes_of_bar, ticks = place(rows, i, abreast, label="<colorbar>"), MaxNLocator(5)
        # Values outside of the range have the colours of its ends.
        colour_bar(
            figure, scale, label=layer.label, cax=axes_of_bar, orientation="horizontal", extend="both", ticks=ticks
        )
    return figure, axes, scaled

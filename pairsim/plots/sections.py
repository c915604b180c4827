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
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import LinearNDInterpolator

from pairsim.plots.field_values import Field, particle_velocity
from pairsim.plots.labels import tex_number
from pairsim.plots.meridional_section import outlines, tessellate
from pairsim.plots.style import DIVERGING, GREY, SEQUENTIAL, Page, colour_bar
from pairsim.plots.units import Units
from pairsim.results.units import LENGTH, TIME
from pairsim.results.xdmf import FieldFrame
from pairsim.runtime.arrays import Array

LEAST_HALF = 1.5  # half the length of tube that is seen over its radius, at least
OUTLIERS = 0.995  # part of the values that a scale covers: stresses peak at the poles
STEEP = 30.0  # ratio of the values of a positive field from which its scale is logarithmic
GRID = 361, 91  # points along the tube and across half of it, for streamlines
INWARD, OUTWARD = 7, 9  # streamlines that go with the particles or faster, and slower
LONG = 3.0  # ratio of length to height from which views lie below each other
# Heights of a colour bar, of the labels below an axis, of a title, and of the small print [mm].
BAR, LABELS, TITLE, PRINT = 2.5, 9.5, 10.0, 5.0


@dataclass(frozen=True)
class View:
    """What is seen of one frame.

    Attributes:
        frame: The frame.
        window: z from and to, r from and to.
        particles: Their closed outlines.
        wall: Radius of the tube.
        units: Of what is drawn; the coordinates are in them.
        curve: Whether it is one of a curve and not of a run.
    """

    frame: FieldFrame
    window: tuple[float, float, float, float]
    particles: tuple[Array, ...]
    wall: float
    units: Units
    curve: bool

    def label(self, coordinate: str) -> str:
        """The label of an axis."""
        return f"${coordinate}$  [{self.units.name(LENGTH)}]"

    @property
    def title(self) -> str:
        """The time of a frame of a run, or the distance of one of a curve."""
        unit = LENGTH if self.curve else TIME
        value = tex_number(self.frame.t * self.units.factor(unit))
        return f"${'d' if self.curve else 't'} = {value}$ {self.units.name(unit)}"

    def seen(self, solid: bool) -> NDArray[np.bool_]:
        """The cells of the liquid or of the particles in the window."""
        z = self.frame.points[self.frame.cells, 0]
        inside = (z.max(axis=1) > self.window[0]) & (z.min(axis=1) < self.window[1])
        return np.asarray(inside & ((self.frame.region > 0) == solid))


@dataclass(frozen=True)
class Layer:
    """Values in the liquid or in the particles of each view, with their colours.

    Attributes:
        values: At the nodes of each view's frame.
        label: Of the colour bar.
        liquid, solid: Where it is drawn.
        diverging: Whether colours are centred on zero.
        lines: Whether streamlines are drawn over it.
        sides: Whether it is drawn above the axis (1), below it (-1), or on both sides.
    """

    values: Sequence[Array]
    label: str
    liquid: bool
    solid: bool
    diverging: bool
    lines: bool = False
    sides: tuple[int, ...] = (1, -1)

    def cells(self, view: View) -> Iterator[tuple[bool, NDArray[np.bool_]]]:
        """Whether they are those of particles, and the cells of a view where it is drawn."""
        for solid, drawn in ((False, self.liquid), (True, self.solid)):
            if drawn and (chosen := view.seen(solid)).any():
                yield solid, chosen


def views_of(frames: Sequence[FieldFrame], units: Units, curve: bool) -> list[View]:
    """Windows of one length, each centred on the particles of its frame."""
    frames = [replace(frame, points=frame.points * units.factor(LENGTH)) for frame in frames]
    arcs = [outlines(frame) for frame in frames]
    ranges = []
    for frame, lines in zip(frames, arcs, strict=True):
        z = np.concatenate([line[:, 0] for line in lines]) if lines else np.array([frame.points[:, 0].mean()])
        margin = max((float(np.ptp(line[:, 0])) for line in lines), default=2 * float(frame.points[:, 1].max()))
        ranges.append((float(z.min()) - margin, float(z.max()) + margin))
    half = max(LEAST_HALF * float(frames[0].points[:, 1].max()), *((high - low) / 2 for low, high in ranges))
    views = []
    for frame, lines, (low, high) in zip(frames, arcs, ranges, strict=True):
        wall = float(frame.points[:, 1].max())
        window = ((low + high) / 2 - half, (low + high) / 2 + half, -1.04 * wall, 1.04 * wall)
        closed = tuple(np.vstack([line, (line * [1, -1])[::-1]]) for line in lines)
        views.append(View(frame, window, closed, wall, units, curve))
    return views


def layer_of(name: str, field: Field, views: Sequence[View]) -> Layer:
    """A field as a layer, in the liquid and, where they have it, in the particles."""
    data = views[-1].frame.point_data
    units = views[0].units
    values = [field.values(view.frame) * units.factor(field.unit) for view in views]
    label = f"${field.symbol}$  [{units.name(field.unit)}]"
    return Layer(values, label, field.liquid in data, field.solid in data, field.diverging, lines=name == "streamlines")


def scale_of(layer: Layer, views: Sequence[View]) -> ScalarMappable:
    """Colours of a layer, the same in all views; outliers do not set the range."""
    pairs = zip(views, layer.values, strict=True)
    found = [values[view.frame.cells[chosen]].ravel() for view, values in pairs for _, chosen in layer.cells(view)]
    every = np.concatenate(found) if found else np.zeros(1)
    if layer.diverging:
        reach = float(np.quantile(np.abs(every), OUTLIERS)) or 1.0
        return ScalarMappable(Normalize(-reach, reach), DIVERGING)
    low, high = float(every.min()), float(np.quantile(every, OUTLIERS))
    high = high if high > low else low + 1.0
    norm = LogNorm(low, high) if low > 0 and high / low > STEEP else Normalize(low, high)
    return ScalarMappable(norm, SEQUENTIAL)


def draw_view(axis: Axes, view: View, place: int, layers: Sequence[tuple[Layer, ScalarMappable]]) -> None:
    """One view: colours between the nodes are interpolated; particles without colours are grey.

    Args:
        axis: The panel.
        view: What is seen.
        place: Number of the view among those of the layers.
        layers: With their colours.
    """
    coloured = False
    for layer, scale in layers:
        for solid, chosen in layer.cells(view):
            coloured |= solid
            part = tessellate(view.frame, chosen, layer.values[place])
            # Particles lie over the axis and over streamlines.
            look: Any = {"cmap": scale.cmap, "norm": scale.norm, "rasterized": True, "zorder": 1.6 if solid else 1}
            for side in layer.sides:
                axis.tripcolor(part.triangulation(side), part.values, shading="gouraud", **look)
        if layer.lines:
            _streamlines(axis, view)
    for line in view.particles:
        if not coloured:
            axis.fill(*line.T, color=GREY, linewidth=0, zorder=2)
        axis.plot(*line.T, color="black", linestyle="-", linewidth=0.7, zorder=3)
    for r in (view.wall, -view.wall):
        axis.plot(view.window[:2], [r, r], color="black", linestyle="-", linewidth=0.9, zorder=3)
    if any(layer.sides != (1, -1) for layer, _ in layers):
        axis.axhline(0, color="black", linestyle="-", linewidth=0.4, zorder=1.5)
    axis.set(xlim=view.window[:2], ylim=view.window[2:], aspect="equal", ylabel=view.label("r"))
    axis.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axis.set_yticks([-view.wall, 0.0, view.wall])
    axis.grid(visible=False)


def mark_view(axis: Axes, view: View) -> None:
    """A title, which way the liquid flows, which particle is which: T, L of a pair, else numbers from upstream."""
    axis.set_title(view.title)
    look: dict[str, Any] = {"zorder": 4, "path_effects": [withStroke(linewidth=1.6, foreground="white")]}
    axis.text(0.015, 0.955, r"flow $\rightarrow$", transform=axis.transAxes, va="top", fontsize=7, **look)
    count = len(view.particles)
    names = "TL" if count == 2 else [str(i) for i in range(1, count + 1)] if count > 2 else []
    for name, line in zip(names, view.particles, strict=False):
        z = float(line[:, 0].min() + line[:, 0].max()) / 2
        axis.text(z, 0, name, ha="center", va="center", **look)


def _streamlines(axis: Axes, view: View) -> None:
    """Contours of the stream function psi, d psi/dr = r (u_z - U), in the frame of the particles."""
    points, first = np.unique(view.frame.points.round(9), axis=0, return_index=True)
    z, r = np.linspace(*view.window[:2], GRID[0]), np.linspace(0, view.wall, GRID[1])
    velocity = view.frame.point_data["velocity"][first, 0] - particle_velocity(view.frame)
    # The velocity is continuous, and that of a rigid particle the same all along its surface: cells are not needed.
    grid = np.meshgrid(z, r)
    u = LinearNDInterpolator(points, velocity)(*grid)
    psi = cumulative_trapezoid(np.nan_to_num(u) * r[:, None], r, axis=0, initial=0)
    places = np.column_stack([each.ravel() for each in grid])
    inside = np.zeros(len(places), dtype=bool)
    for line in view.particles:
        inside |= Outline(line).contains_points(places)
    inside = inside.reshape(psi.shape)
    # Particles that approach each other move in this frame: lines that close to a surface would end on it.
    near = float(np.abs(psi[inside]).max(initial=0.0))
    low, high = min(float(psi.min()), 0.0), max(float(psi.max()), 0.0)
    slow, fast = (np.linspace(0, 1, count + 1)[1:-1] for count in (OUTWARD, INWARD))
    levels = np.unique(np.concatenate([low * slow[::-1], high * fast**2]))
    look: dict[str, Any] = {"colors": "black", "linewidths": 0.45, "linestyles": "solid", "zorder": 1.5}
    for side in (1, -1):
        shown = np.ma.masked_array(psi, inside)
        axis.contour(z, side * r, shown, levels=levels[np.abs(levels) > near], **look)


def sheet(
    page: Page, views: Sequence[View], layers: Sequence[Layer], count: int, first: int = 0
) -> tuple[Figure, list[Axes], list[tuple[Layer, ScalarMappable]]]:
    """A figure with panels for views, two in a row where there is room, and below them the colour bars of all layers.

    Args:
        page: What it is drawn for.
        views: All that is seen.
        layers: What is drawn in them.
        count: How many panels.
        first: The first view that sets the range of colours, so that the start-up of a run does not.
    """
    z_min, z_max, r_min, r_max = views[0].window
    columns = 1 if page.narrow or count == 1 or z_max - z_min > LONG * (r_max - r_min) else 2
    rows, abreast = -(-count // columns), 1 if page.narrow else len(layers)
    inner = (page.width / columns - 15) * (r_max - r_min) / (z_max - z_min)
    bars = len(layers) // abreast
    figure = page.figure((inner + TITLE) * rows + (BAR + LABELS) * bars + LABELS + PRINT)
    across = math.lcm(columns, abreast)
    grid = figure.add_gridspec(rows + bars, across, height_ratios=[inner] * rows + [BAR] * bars)
    wide, each = across // columns, across // abreast
    axes = [figure.add_subplot(grid[i // columns, i % columns * wide : (i % columns + 1) * wide]) for i in range(count)]
    scaled = [(layer, scale_of(replace(layer, values=layer.values[first:]), views[first:])) for layer in layers]
    for axis in axes[-columns:]:
        axis.set_xlabel(views[0].label("z"))
    for i, (layer, scale) in enumerate(scaled):
        place = grid[rows + i // abreast, i % abreast * each : (i % abreast + 1) * each]
        cax, beyond = figure.add_subplot(place, label="<colorbar>"), "both" if layer.diverging else "max"
        few = MaxNLocator(5)
        colour_bar(figure, scale, orientation="horizontal", label=layer.label, cax=cax, extend=beyond, ticks=few)
    return figure, axes, scaled

"""The picture of the disturbance of the flow by displaced particles: streamlines in the plane of the displacement."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.path import Path as Outline
from scipy.interpolate import LinearNDInterpolator

from pairsim.plots.chart import small_print
from pairsim.plots.labels import case_parts, parts_along, read_case, symbol, tex_number
from pairsim.plots.sections import Layer, View, draw_view, mark_view, sheet, views_of
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.quantities.kinds import LENGTH, RATE
from pairsim.questions.focus import column_of
from pairsim.questions.focus.picture import scales_at
from pairsim.record.columns import DISTANCE, FOLLOWED
from pairsim.record.xdmf import DISTURBED_VELOCITY, FieldFrame, read_frame, read_times
from pairsim.runtime.arrays import Array

MOST_VIEWS = 4
GRID = 181, 91  # points along the tube and across all of it
DENSITY = 0.9  # of streamlines across the tube, in the unit of matplotlib


@printing()
def draw_streamlines(directory: Path, out: Path, page: Page) -> list[Path]:
    """Draw `disturbance`: of a single particle at some of the followed values, of several particles at the last value.

    Particles are displaced upwards. Colours show the magnitude of the velocity, streamlines its direction.
    """
    units, case = Units.of(directory, page.physical), read_case(directory / "case.yaml")
    count = len(read_times(directory))
    frames = [read_frame(directory, int(i)) for i in np.linspace(0, count - 1, min(count, MOST_VIEWS)).round()]
    names = [name for name in frames[-1].point_data if name.startswith(DISTURBED_VELOCITY)]
    drawn = [(frame, names[0]) for frame in frames] if len(names) == 1 else [(frames[-1], name) for name in names]
    key = case.followed
    views = [
        replace(view, title=_title(name, len(names), frame.t, key, units))
        for view, (frame, name) in zip(views_of([frame for frame, _ in drawn], units, True), drawn, strict=True)
    ]
    scales = scales_at(directory, units)
    values = [
        np.linalg.norm(frame.point_data[name][:, :2], axis=1) * RATE.factor(scales(frame.t)) for frame, name in drawn
    ]
    label = rf"$|u'|$ per displacement  [{units.name(RATE)}]"
    layer = Layer(values, label, liquid=True, solid=bool((frames[-1].region > 0).any()), diverging=False)
    figure, axes, scaled = sheet(page, views, [layer], len(views))
    if page.legend:
        physical = units.scales is not None
        small_print(figure, parts_along(case, key, physical) if key else case_parts(case, physical=physical))
    for place, (axis, view, (frame, name)) in enumerate(zip(axes, views, drawn, strict=True)):
        draw_view(axis, view, place, scaled)
        mark_view(axis, view)
        _draw_lines(axis, view, frame, name)
        axis.set_ylabel(view.label("x"))
    return page.save(figure, out, "disturbance")


def _title(name: str, count: int, at: float, key: str, units: Units) -> str:
    """The title of a view: which of several particles is displaced, or the value of the followed key."""
    followed = column_of(key) if key else None
    if count > 1:
        return f"particle {name.rpartition('_')[2]} displaced"
    if followed is None:
        return ""
    if followed is FOLLOWED:
        return f"{symbol(key)} = ${tex_number(at)}$"
    unit = f" {units.name(LENGTH)}" if followed is DISTANCE else ""
    number = at * units.factor(LENGTH) if followed is DISTANCE else at
    return f"${followed.symbol} = {tex_number(number)}${unit}"


def _draw_lines(axis: Axes, view: View, frame: FieldFrame, name: str) -> None:
    """Streamlines of the velocity in the plane, which has u_z of opposite signs on both sides of the axis."""
    velocity = in_plane(frame, name)
    z, x = np.linspace(*view.window[:2], GRID[0]), np.linspace(-view.wall, view.wall, GRID[1])
    places = np.stack(np.meshgrid(z, x), axis=-1)
    scale = view.wall / float(frame.points[:, 1].max())
    u = velocity(places / scale)
    inside = np.zeros(u.shape[:2], dtype=bool)
    for outline in view.particles:
        inside |= Outline(outline).contains_points(places.reshape(-1, 2)).reshape(inside.shape)
    shown = np.ma.masked_array(np.nan_to_num(u), np.stack([inside, inside], axis=-1))
    u_z, u_x = shown[..., 0], shown[..., 1]
    axis.streamplot(z, x, u_z, u_x, density(view), linewidth=0.45, color="black", arrowsize=0.5, zorder=1.5)
    axis.set(xlim=view.window[:2], ylim=view.window[2:])


def density(view: View) -> tuple[float, float]:
    """Densities of streamlines along and across the tube for `streamplot`, so that both are equally dense."""
    length, height = view.window[1] - view.window[0], view.window[3] - view.window[2]
    return DENSITY * length / height, DENSITY


def in_plane(frame: FieldFrame, name: str) -> Any:
    """The function of places (z, x), shape (..., 2), for the velocity (u_z, u_x) that a displacement along x adds.

    Both are in the plane of the axis and x; the velocity has the same shape.
    """
    points, first = np.unique(frame.points.round(9), axis=0, return_index=True)
    half = LinearNDInterpolator(points, frame.point_data[name][first, :2])

    def velocity(places: Array) -> Array:
        z, x = np.moveaxis(places, -1, 0)
        return np.asarray(half(z, np.abs(x)) * np.stack([np.where(x < 0, -1.0, 1.0), np.ones_like(x)], axis=-1))

    return velocity

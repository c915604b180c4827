"""`pairsim plot`: pictures of a run, drawn from its folder alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

from pairsim.results.columns import column
from pairsim.results.meridional_section import Surface, outlines, tessellate
from pairsim.results.output import read_series
from pairsim.results.xdmf import FieldFrame, read_frame, read_times
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

GREY = "0.72"
NOISE = 1e-9  # a curve below this is zero to rounding and not blown up to fill its panel


def plot_run(directory: Path, out: Path | None = None) -> list[Path]:
    """Draw series.png, and fields.png where fields were written, and perturbation.png in a viscoelastic liquid.

    Args:
        directory: Folder of a run, finished or not.
        out: Folder of the pictures, made if needed; the run's own by default.

    Returns:
        The files written.

    Raises:
        InputError: The folder is not that of a run, or holds no results yet.
    """
    if not (directory / "series.csv").is_file():
        raise InputError(str(directory), "", None, "is not the folder of a run that has begun: it has no series.csv")
    series = read_series(directory / "series.csv")
    if "t" not in series or not len(series["t"]):
        raise InputError(str(directory / "series.csv"), "", None, "has no rows yet; wait for the first step")
    target = out or directory
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(str(target), "-o", None, f"cannot be used as a folder ({error.strerror})") from error
    case = read_case(directory / "case.yaml")
    written = [draw_series(series, case, target / "series.png")]
    if (directory / "fields.h5").is_file() and (count := len(read_times(directory))):
        frames = [read_frame(directory, i) for i in ((0, count - 1) if count > 1 else (0,))]
        written.append(draw_fields(frames, case, target / "fields.png"))
        if set(PERTURBATIONS) <= set(frames[-1].point_data) and case.get("particles", 2):
            written.append(draw_perturbation(frames[-1], case, target / "perturbation.png"))
    return written


def read_case(file: Path) -> dict[str, Any]:
    """Content of a case.yaml, empty if there is none."""
    if not file.is_file():
        return {}
    try:
        case = yaml.safe_load(file.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(str(file), "", None, f"is not YAML ({error})") from error
    return case if isinstance(case, dict) else {}


def case_title(case: dict[str, Any]) -> str:
    """The parameters of the case in the paper's symbols; a list of equal entries is one number."""
    names = {"beta": r"\beta", "De": r"\mathrm{De}", "Ca_e": r"\mathrm{Ca}_e", "d0": "d_0"}
    parts = []
    for key, tex in names.items():
        value = case.get(key)
        entries = value if isinstance(value, list) else [value]
        if not entries or entries[0] is None:
            continue
        shown = entries[:1] if all(entry == entries[0] for entry in entries) else entries
        parts.append(f"${tex} = {', '.join(format(entry, 'g') for entry in shown)}$")
    name = str(case["name"]).replace("$", r"\$") + ":  " if case.get("name") else ""
    return name + ",  ".join(parts)


def axis_label(names: list[str]) -> str:
    """Axis label of some columns, which share their unit."""
    entries = [column(name) for name in names]
    symbols = ", ".join(f"${entry.symbol}$" for entry in entries[:3]) + (", ..." if len(entries) > 3 else "")
    return symbols + (f"   [${entries[0].unit}$]" if entries[0].unit else "")


def draw_series(series: dict[str, Array], case: dict[str, Any], path: Path) -> Path:
    """Relative velocities (or velocities, or the pressure drop) and D against time; dU against d.

    Args:
        series: Columns of series.csv.
        case: Content of case.yaml, for the title.
        path: The PNG.
    """

    def of(prefix: str) -> list[str]:
        return [name for name in series if name == prefix or name.startswith(prefix + "_")]

    relative = of("dU")
    panels = [("t", relative or of("U") or ["dp"])]
    if shapes := of("D"):
        panels.append(("t", shapes))
    curves = [(name, "d" + name.removeprefix("dU")) for name in relative]
    count = len(panels) + bool(curves)
    figure = Figure(figsize=(4.7 * count, 3.9), layout="constrained")
    axes = figure.subplots(1, count, squeeze=False)[0]
    for axis, (_, names) in zip(axes, panels, strict=False):
        for name in names:
            _curve(axis, series["t"], series[name], f"${column(name).symbol}$")
        finish_axis(axis, axis_label(["t"]), axis_label(names), [series[name] for name in names], legend=len(names) > 1)
    if curves:
        for name, gap in curves:
            _curve(axes[-1], series[gap], series[name], f"${column(name).symbol}({column(gap).symbol})$")
        gaps = axis_label([gap for _, gap in curves])
        finish_axis(axes[-1], gaps, axis_label(relative), [series[name] for name in relative], legend=len(curves) > 1)
    figure.suptitle(case_title(case))
    figure.savefig(path, dpi=160)
    return path


def _curve(axis: Axes, x: Array, y: Array, label: str) -> None:
    axis.plot(x, y, "o-" if len(x) == 1 else "-", linewidth=1.6, markersize=4, label=label)


def finish_axis(axis: Axes, x: str, y: str, curves: list[Array], *, legend: bool) -> None:
    """Labels, grid, the line y = 0, and a range that does not blow rounding up."""
    low, high = min((float(c.min()) for c in curves), default=0.0), max((float(c.max()) for c in curves), default=1.0)
    if high - low < NOISE:
        middle = (low + high) / 2
        axis.set_ylim(middle - 1e-6, middle + 1e-6)
    if low < 0 < high:
        axis.axhline(0, color="0.6", linewidth=0.8, zorder=0)
    axis.ticklabel_format(axis="y", style="sci", scilimits=(-2, 4))
    axis.set(xlabel=x, ylabel=y)
    axis.grid(color="0.92")
    axis.set_axisbelow(True)
    if legend:
        axis.legend(frameon=False)


@dataclass(frozen=True)
class _View:
    """What is seen of one frame; `surfaces` are (surface, is it solid)."""

    frame: FieldFrame
    window: tuple[float, float, float, float]
    surfaces: list[tuple[Surface, bool]]
    discs: list[Array]  # rigid particles, closed outlines
    lines: list[Array]


def draw_fields(frames: list[FieldFrame], case: dict[str, Any], path: Path) -> Path:
    """The meridional section around the particles, one row a frame: u_z in the liquid, tau_zz in the soft particles.

    Args:
        frames: At least one frame.
        case: Content of case.yaml, for the title.
        path: The PNG.
    """
    views = _views(frames)
    flow, stress = _scales(views)
    z_min, z_max, r_min, r_max = views[0].window
    width = 9.5
    height = width * (r_max - r_min) / (z_max - z_min) * 0.88 + 0.45
    figure = Figure(figsize=(width, height * len(views) + 1.5), layout="constrained")
    axes = figure.subplots(len(views), 1, squeeze=False)[:, 0]
    for axis, view in zip(axes, views, strict=True):
        _draw(axis, view, flow, stress)
        axis.set(xlim=view.window[:2], ylim=view.window[2:], ylabel=r"$r\ [D_c]$", title=f"$t = {view.frame.t:.4g}$")
        axis.title.set_size("medium")
    axes[-1].set_xlabel(r"$z\ [D_c]$")
    bars = [(flow, r"liquid: $u_z\ [U_{av}]$")]
    if any(solid for view in views for _, solid in view.surfaces):
        bars.append((stress, r"particles: $\tau_{zz}\ [\eta_0 U_{av}/D_c]$"))
    for scale, label in bars:
        bar = figure.colorbar(scale, ax=list(axes), location="bottom", aspect=35, shrink=0.8, pad=0.02, label=label)
        bar.locator = MaxNLocator(7)
        bar.update_ticks()
    figure.suptitle(case_title(case))
    figure.savefig(path, dpi=160)
    return path


PERTURBATIONS = {
    "tau_p_zz_extra": r"$\tau_{zz} - \tau_{zz\infty}\ [\eta_0 U_{av}/D_c]$",
    "pressure_extra": r"$p - p_\infty\ [\eta_0 U_{av}/D_c]$",
}


def draw_perturbation(frame: FieldFrame, case: dict[str, Any], path: Path) -> Path:
    """What the particles change in the liquid's axial stress and pressure, as in the paper's Figs. 14 and 15."""
    figure = Figure(figsize=(9.5, 9.0), layout="constrained")
    for axis, (name, label) in zip(figure.subplots(len(PERTURBATIONS), 1), PERTURBATIONS.items(), strict=True):
        (view,) = _views([frame])
        z_min, z_max = view.window[:2]
        z = frame.points[frame.cells, 0]
        seen = (z.max(axis=1) > z_min) & (z.min(axis=1) < z_max) & (frame.region == 0)
        part = tessellate(frame, seen, frame.point_data[name]).mirrored()
        reach = float(np.quantile(np.abs(part.values), 0.995)) or 1.0
        mesh = Triangulation(part.points[:, 0], part.points[:, 1], part.triangles)
        drawn = axis.tripcolor(
            mesh, part.values, cmap="RdBu_r", norm=Normalize(-reach, reach), shading="gouraud", rasterized=True
        )
        for line in view.lines:
            axis.plot(*line.T, color="black", linewidth=1.2)
        axis.set(xlim=view.window[:2], ylim=view.window[2:], aspect="equal", ylabel=r"$r\ [D_c]$")
        figure.colorbar(drawn, ax=axis, label=label, shrink=0.8)
    axis.set_xlabel(r"$z\ [D_c]$")
    figure.suptitle(f"{case_title(case)},  $t = {frame.t:.4g}$")
    figure.savefig(path, dpi=160)
    return path


def _views(frames: list[FieldFrame]) -> list[_View]:
    """Windows of one width, each centred on the particles of its frame, and what lies in them."""
    arcs = [outlines(frame) for frame in frames]
    ranges = []
    for frame, lines in zip(frames, arcs, strict=True):
        z = np.concatenate([line[:, 0] for line in lines]) if lines else np.array([frame.points[:, 0].mean()])
        margin = max((float(np.ptp(line[:, 0])) for line in lines), default=1.0)
        ranges.append((float(z.min()) - margin, float(z.max()) + margin))
    half = max(0.75, *((high - low) / 2 for low, high in ranges))
    views = []
    for frame, lines, (low, high) in zip(frames, arcs, ranges, strict=True):
        wall = float(frame.points[:, 1].max())
        z_min, z_max = (low + high) / 2 - half, (low + high) / 2 + half
        z = frame.points[frame.cells, 0]
        seen = (z.max(axis=1) > z_min) & (z.min(axis=1) < z_max)
        liquid, solid = seen & (frame.region == 0), seen & (frame.region > 0)
        surfaces = [(tessellate(frame, liquid, frame.point_data["velocity"][:, 0]).mirrored(), False)]
        if solid.any():
            stress = frame.point_data.get("tau_s")
            values = np.zeros(len(frame.points)) if stress is None else stress[:, 0]
            surfaces.append((tessellate(frame, solid, values).mirrored(), True))
        closed = [np.vstack([line, (line * [1, -1])[::-1]]) for line in lines]
        corners = frame.points[frame.cells[frame.region > 0]].reshape(-1, 2)
        discs = [line for line in closed if not _holds_cells(line, corners)]
        walls = [np.array([[z_min, r], [z_max, r]]) for r in (wall, -wall)]
        window = (z_min, z_max, -1.04 * wall, 1.04 * wall)
        views.append(_View(frame, window, surfaces, discs, [*closed, *walls]))
    return views


def _holds_cells(outline: Array, points: Array) -> bool:
    """Whether there are nodes of a soft particle on the axis between the poles of an outline."""
    inside = (points[:, 0] > outline[:, 0].min()) & (points[:, 0] < outline[:, 0].max())
    return bool(inside.any())


def _scales(views: list[_View]) -> tuple[ScalarMappable, ScalarMappable]:
    """Colours of u_z and of tau_zz, the same in all views; outliers at the poles do not set the range of tau_zz."""
    flow = np.concatenate([surface.values for view in views for surface, solid in view.surfaces if not solid])
    stress = [np.abs(surface.values) for view in views for surface, solid in view.surfaces if solid]
    reach = max((float(np.quantile(values, 0.995)) for values in stress), default=0.0) or 1.0
    low, high = float(flow.min()), float(flow.max())
    return (
        ScalarMappable(Normalize(low, high if high > low else low + 1.0), "viridis"),
        ScalarMappable(Normalize(-reach, reach), "RdBu_r"),
    )


def _draw(axis: Axes, view: _View, flow: ScalarMappable, stress: ScalarMappable) -> None:
    """One view: colours between the nodes are interpolated, rigid particles are grey."""
    for part, solid in view.surfaces:
        scale = stress if solid else flow
        mesh = Triangulation(part.points[:, 0], part.points[:, 1], part.triangles)
        axis.tripcolor(
            mesh, part.values, cmap=scale.cmap, norm=Normalize(*scale.get_clim()), shading="gouraud", rasterized=True
        )
    for disc in view.discs:
        axis.fill(*disc.T, color=GREY)
    for line in view.lines:
        axis.plot(*line.T, color="black", linewidth=1.2)
    axis.set_aspect("equal")

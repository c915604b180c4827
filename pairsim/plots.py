"""`pairsim plot`: pictures of a run, from its folder alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import yaml
from numpy.typing import NDArray

from pairsim.errors import InputError
from pairsim.output import column, read_series
from pairsim.xdmf import FieldFrame, read_frame, read_times

matplotlib.use("Agg")
from matplotlib import pyplot

VIEW_MARGIN = 0.35  # tube shown on each side of the particles, in D_c


def plot_run(directory: Path, out: Path | None = None) -> list[Path]:
    """Draw series.png, and fields.png where fields were written.

    Args:
        directory: Folder of a run.
        out: Folder of the pictures; the run's own by default.

    Returns:
        The files written.

    Raises:
        InputError: The folder holds no run.
    """
    if not (directory / "series.csv").is_file() or not (directory / "case.yaml").is_file():
        raise InputError(str(directory), "", None, "is not the folder of a run: it needs series.csv and case.yaml")
    case = yaml.safe_load((directory / "case.yaml").read_text(encoding="utf-8"))
    series = read_series(directory / "series.csv")
    if len(series["t"]) == 0:
        raise InputError(str(directory), "series.csv", None, "has no rows yet")
    target = out or directory
    target.mkdir(parents=True, exist_ok=True)
    written = [_draw_series(series, case, target / "series.png")]
    if (directory / "fields.h5").is_file() and len(read_times(directory)):
        written.append(draw_fields([read_frame(directory, 0), read_frame(directory, -1)], case, target / "fields.png"))
    return written


def _title(case: dict[str, Any]) -> str:
    names = {"beta": r"\beta", "De": r"\mathrm{De}", "Ca_e": r"\mathrm{Ca}_e", "d0": "d_0"}
    shown = [f"${tex} = {case[key]}$" for key, tex in names.items() if key in case]
    return ", ".join(shown).replace("[", r"[").replace("]", r"]")


def _axis_label(name: str) -> str:
    entry = column(name)
    return f"${entry.symbol}$" + (f" [${entry.unit}$]" if entry.unit else "")


def _draw_series(series: dict[str, NDArray[np.float64]], case: dict[str, Any], path: Path) -> Path:
    """dU (or U) and D against time, and dU against distance."""
    t = series["t"]
    relative = [name for name in series if name == "dU" or name.startswith("dU_")]
    shapes = [name for name in series if name.startswith("D_")]
    panels: list[tuple[str, list[str], str]] = []
    if relative:
        panels.append(("t", relative, "dU"))
    elif velocities := [name for name in series if name.startswith("U_")]:
        panels.append(("t", velocities, velocities[0]))
    else:
        panels.append(("t", ["dp"], "dp"))
    if shapes and any(np.any(series[name] != 0) for name in shapes):
        panels.append(("t", shapes, shapes[0]))
    panels += [(gap, [name], name) for gap, name in _gap_pairs(relative)]
    figure, axes = pyplot.subplots(1, len(panels), figsize=(4.6 * len(panels), 3.8), squeeze=False)
    for axis, (x, names, label) in zip(axes[0], panels, strict=True):
        for name in names:
            axis.plot(series[x] if x != "t" else t, series[name], label=f"${column(name).symbol}$")
        axis.axhline(0, color="0.7", linewidth=0.8, zorder=0)
        axis.set(xlabel=_axis_label(x), ylabel=_axis_label(label))
        if len(names) > 1:
            axis.set_ylabel(", ".join(f"${column(n).symbol}$" for n in names))
            axis.legend(frameon=False)
        axis.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3))
    figure.suptitle(_title(case))
    figure.tight_layout()
    figure.savefig(path, dpi=150)
    pyplot.close(figure)
    return path


def _gap_pairs(relative: list[str]) -> list[tuple[str, str]]:
    return [("d" + name.removeprefix("dU"), name) for name in relative]


def draw_fields(frames: list[FieldFrame], case: dict[str, Any], path: Path) -> Path:
    """Render the meridional section of the tube, one row a frame: u_z in the liquid, tau_zz in the particles."""
    import pyvista as pv

    rows = len(frames)
    plotter = pv.Plotter(off_screen=True, shape=(rows, 1), window_size=(1500, 120 + 560 * rows), border=False)
    speeds = np.concatenate([f.point_data["velocity"][:, 0] for f in frames])
    has_stress = all("tau_s" in f.point_data for f in frames)
    stresses = np.concatenate([f.point_data["tau_s"][:, 0] for f in frames]) if has_stress else np.zeros(1)
    reach = max(abs(float(np.quantile(stresses[stresses != 0], q))) for q in (0.01, 0.99)) if np.any(stresses) else 1.0
    for row, frame in enumerate(frames):
        plotter.subplot(row, 0)
        left, right = _window(frame)
        for soft in (False, True):
            chosen = frame.region > 0 if soft else frame.region == 0
            if not chosen.any():
                continue
            values = frame.point_data["tau_s"][:, 0] if soft else frame.point_data["velocity"][:, 0]
            name = f"tau_zz in the particles ({row})" if soft else f"u_z in the liquid ({row})"
            title = "tau_zz, particles" if soft else "u_z, liquid"
            for sign in (1.0, -1.0):
                grid = _grid(frame, chosen, sign)
                grid.point_data[name] = values
                grid = grid.clip_box([left, right, -1, 1, -1, 1], invert=False)
                plotter.add_mesh(
                    grid,
                    scalars=name,
                    cmap="RdBu_r" if soft else "viridis",
                    clim=(-reach, reach) if soft else (float(speeds.min()), float(speeds.max())),
                    show_scalar_bar=sign > 0 and row == rows - 1,
                    scalar_bar_args={
                        "title": title,
                        "n_labels": 4,
                        "position_x": 0.55 if soft else 0.08,
                        "position_y": 0.01,
                        "width": 0.38,
                        "height": 0.1,
                        "color": "black",
                        "fmt": "%.2g",
                        "title_font_size": 20,
                        "label_font_size": 18,
                    },
                )
                edges = grid.extract_surface(nonlinear_subdivision=3, algorithm=None).extract_feature_edges(
                    boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
                )
                # The axis bounds the half-section, not the particle.
                edges = edges.extract_points(np.abs(edges.points[:, 1]) > 1e-9, adjacent_cells=True)
                if soft and edges.n_points:
                    plotter.add_mesh(edges, color="black", line_width=2)
        plotter.add_text(f"t = {frame.t:.4g}", position="upper_left", font_size=12, color="black")
        plotter.view_xy()
        plotter.enable_parallel_projection()
        plotter.camera.focal_point = ((left + right) / 2, -0.06, 0.0)
        plotter.camera.position = ((left + right) / 2, -0.06, 5.0)
        plotter.camera.parallel_scale = max(0.62, (right - left) / 2 * (560 / 1500) * 1.05)
    plotter.set_background("white")
    plotter.screenshot(path)
    plotter.close()
    return path


def _grid(frame: FieldFrame, chosen: NDArray[np.bool_], sign: float) -> Any:
    """Cells of one kind in VTK's quadratic triangles, mirrored to r < 0 for sign -1."""
    import pyvista as pv

    cells = frame.cells[chosen]
    points = np.column_stack([frame.points[:, 0], sign * frame.points[:, 1], np.zeros(len(frame.points))])
    kind = pv.CellType.QUADRATIC_TRIANGLE if cells.shape[1] == 6 else pv.CellType.BIQUADRATIC_QUAD
    listed = np.column_stack([np.full(len(cells), cells.shape[1]), cells]).ravel()
    return pv.UnstructuredGrid(listed, np.full(len(cells), kind), points)


def _window(frame: FieldFrame) -> tuple[float, float]:
    """Axial range that shows the particles: the soft ones, and rigid ones as the holes on the axis."""
    nodes = frame.points[np.unique(frame.cells[frame.region > 0])] if np.any(frame.region > 0) else np.empty((0, 2))
    liquid = np.unique(frame.cells[frame.region == 0])
    on_axis = np.sort(frame.points[liquid][frame.points[liquid, 1] < 1e-9, 0])
    steps = np.diff(on_axis)
    near = np.concatenate([nodes[:, 0], on_axis[:-1][steps > 0.15], on_axis[1:][steps > 0.15]])
    near = near[np.abs(near) < 0.8 * max(abs(on_axis[0]), abs(on_axis[-1]))]
    if near.size == 0:
        return -1.0, 1.0
    return float(near.min()) - VIEW_MARGIN, float(near.max()) + VIEW_MARGIN

"""Off-screen rendering with pyvista, in a process of its own.

Without X server, EGL and OSMesa, VTK does not raise an error but crashes; a child process keeps that away from the
program. On Linux EGL comes first (it needs neither a display nor a graphics card), then what VTK chooses, then OSMesa.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pairsim.runtime.child_process import module_command
from pairsim.runtime.errors import PairsimError

WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
WINDOWS = ("vtkEGLRenderWindow", "", "vtkOSOpenGLRenderWindow") if sys.platform == "linux" else ("",)
TIME_LIMIT = 300.0  # seconds; software rendering on a busy machine is slow, a hanging driver is for ever


class RenderError(PairsimError):
    """This machine cannot render off screen."""


@dataclass(frozen=True)
class Picture:
    """What to render: the window in (z, r), coloured triangles, lines on top of them.

    Attributes:
        window: z_min, z_max, r_min, r_max.
        size: Width and height in pixels, of the window's proportions.
        surfaces: Points (n, 2), triangles (m, 3), colours of the nodes (n, 3) in 0..255; later ones cover earlier ones.
        lines: Polylines (k, 2), black.
    """

    window: tuple[float, float, float, float]
    size: tuple[int, int]
    surfaces: list[tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.uint8]]]
    lines: list[NDArray[np.float64]]


def render(pictures: list[Picture]) -> list[NDArray[np.uint8]]:
    """Render pictures to RGB images (height, width, 3).

    Raises:
        RenderError: No kind of off-screen window works here; the message says what each one answered.
    """
    with tempfile.TemporaryDirectory() as scratch:
        job, result = Path(scratch) / "job.npz", Path(scratch) / "images.npz"
        np.savez(job, **_pack(pictures))  # type: ignore[arg-type]
        answers = []
        for window in WINDOWS:
            environment = {**os.environ, **({WINDOW: window} if window else {})}
            command = module_command("pairsim.results.render", str(job), str(result))
            try:
                done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=TIME_LIMIT)
            except (OSError, subprocess.TimeoutExpired) as error:
                answers.append(f"{window or 'default'}: {error}")
                continue
            if done.returncode == 0 and result.is_file():
                with np.load(result) as images:
                    return [images[str(i)] for i in range(len(pictures))]
            answers.append(f"{window or 'default'}: exit code {done.returncode}")
    raise RenderError("cannot render off screen (install libegl1 or libosmesa6); " + "; ".join(answers))


def _pack(pictures: list[Picture]) -> dict[str, NDArray]:
    """Pictures as named arrays, which travel in an npz file without pickling."""
    packed: dict[str, NDArray] = {"count": np.array(len(pictures))}
    for i, picture in enumerate(pictures):
        packed[f"{i}/window"], packed[f"{i}/size"] = np.array(picture.window), np.array(picture.size)
        packed[f"{i}/counts"] = np.array([len(picture.surfaces), len(picture.lines)])
        for k, surface in enumerate(picture.surfaces):
            for name, part in zip(("points", "triangles", "colours"), surface, strict=True):
                packed[f"{i}/{k}/{name}"] = np.asarray(part)
        for k, line in enumerate(picture.lines):
            packed[f"{i}/line/{k}"] = line
    return packed


def _child(job: Path, result: Path) -> None:
    """Render what `_pack` packed; runs in the child process."""
    import pyvista as pv

    def space(plane: NDArray[np.float64], height: float) -> NDArray[np.float64]:
        return np.column_stack([plane, np.full(len(plane), height)])

    images = {}
    with np.load(job) as packed:
        for i in range(int(packed["count"])):
            z_min, z_max, r_min, r_max = packed[f"{i}/window"]
            surfaces, lines = packed[f"{i}/counts"]
            plotter = pv.Plotter(off_screen=True, window_size=[int(n) for n in packed[f"{i}/size"]])
            plotter.set_background("white")
            for k in range(int(surfaces)):
                parts = [packed[f"{i}/{k}/{name}"] for name in ("points", "triangles", "colours")]
                mesh = pv.PolyData.from_regular_faces(space(parts[0], 1e-4 * k), parts[1])
                mesh.point_data["colour"] = parts[2]
                plotter.add_mesh(mesh, scalars="colour", rgb=True, lighting=False, show_scalar_bar=False)
            for k in range(int(lines)):
                line = pv.lines_from_points(space(packed[f"{i}/line/{k}"], 1e-2))
                plotter.add_mesh(line, color="black", line_width=3, lighting=False)
            centre = ((z_min + z_max) / 2, (r_min + r_max) / 2)
            plotter.enable_parallel_projection()
            plotter.camera_position = [(*centre, 1.0), (*centre, 0.0), (0, 1, 0)]
            plotter.camera.parallel_scale = (r_max - r_min) / 2
            plotter.camera.clipping_range = (0.1, 10.0)
            images[str(i)] = plotter.screenshot(None, return_img=True)[..., :3]
            plotter.close()
    np.savez(result, **images)


if __name__ == "__main__":
    _child(Path(sys.argv[1]), Path(sys.argv[2]))

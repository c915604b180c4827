"""Animations of fields.xdmf, as MP4 (by ffmpeg) or GIF."""

from __future__ import annotations

import importlib.util
import shutil
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl

from pairsim.plots.chart import small_print
from pairsim.plots.fields import pictures_of
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.sections import Layer, View, draw_view, mark_view, sheet, views_of
from pairsim.plots.style import Page, picture_file, printing
from pairsim.plots.units import Units
from pairsim.results.folder import make_folder
from pairsim.results.xdmf import read_frame, read_times
from pairsim.runtime.errors import InputError

DPI = 150
SECONDS = 6.0  # of an animation


def ffmpeg() -> str | None:
    """Path of ffmpeg: that of the system, else the one in the package imageio-ffmpeg; None without both."""
    if (found := shutil.which("ffmpeg")) is not None or importlib.util.find_spec("imageio_ffmpeg") is None:
        return found
    import imageio_ffmpeg

    try:
        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except RuntimeError:  # the package comes without a binary on some platforms
        return None


def default_movie() -> str:
    """The kind of animation if none is asked for: an MP4 where ffmpeg is found, else a GIF."""
    return "mp4" if ffmpeg() is not None else "gif"


@printing()
def animate(directory: Path, out: Path, page: Page, *, curve: bool, field: str | None = None) -> list[Path]:
    """Make `fields` or each `field-NAME` an animation of all frames.

    Args:
        directory: Folder of a run or a curve.
        out: Folder of the animation.
        page: Its width, and its formats: mp4, gif or both.
        curve: Whether it is a curve.
        field: As in `pairsim.plots.fields.draw_fields`.

    Returns:
        The files written.

    Raises:
        InputError: There are fewer than two frames, the field is not there, or there is no ffmpeg for an MP4.
    """
    if "mp4" in page.formats and ffmpeg() is None:
        allowed = "needs ffmpeg, which was not found: pip install imageio-ffmpeg, or use --format gif"
        raise InputError("--format", "", "mp4", allowed)
    count = len(read_times(directory))
    if count < 2:
        allowed = f"must be left out: {directory} has {'one frame' if count else 'no frame'} of fields"
        raise InputError("--animate", "", None, allowed)
    units = Units.of(directory, page.physical)
    views = views_of([read_frame(directory, i) for i in range(count)], units, curve)
    parts = case_parts(read_case(directory / "case.yaml"), {"d0"} if curve else ())
    make_folder(out)
    written = []
    for stem, layers in pictures_of(directory, views, field).items():
        for kind in page.formats:
            written.append(out / f"{stem}.{kind}")
            _write(written[-1], page, views, layers, parts, curve)
    return written


def _write(
    path: Path, page: Page, views: Sequence[View], layers: Sequence[Layer], parts: Sequence[str], curve: bool
) -> None:
    """Write one animation; the file appears whole."""
    from matplotlib.animation import FFMpegWriter, PillowWriter

    figure, (axis,), scaled = sheet(page, views, layers, 1, 0 if curve else len(views) // 2)
    small_print(figure, parts)
    with picture_file(path) as part, mpl.rc_context({"animation.ffmpeg_path": ffmpeg() or "ffmpeg"}):
        writer = (FFMpegWriter if path.suffix == ".mp4" else PillowWriter)(fps=max(2, round(len(views) / SECONDS)))
        with writer.saving(figure, str(part), DPI):
            for place, view in enumerate(views):
                axis.clear()
                draw_view(axis, view, place, scaled)
                mark_view(axis, view)
                axis.set_xlabel(view.label("z"))
                writer.grab_frame()

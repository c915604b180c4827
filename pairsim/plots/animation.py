"""Animations of fields.xdmf, as MP4 (by ffmpeg) or GIF."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter

from pairsim.plots.field_values import FIELDS, chosen_fields
from pairsim.plots.fields import frame_count, motion_of, title_of
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.sections import (
    Layer,
    View,
    add_bar,
    bar_height,
    draw_view,
    layer_of,
    scale_of,
    view_height,
    views_of,
)
from pairsim.plots.style import Page, picture_file, printing, small_print
from pairsim.results.columns import LENGTH
from pairsim.results.output import make_folder
from pairsim.results.xdmf import read_frame
from pairsim.runtime.errors import InputError

DPI = 150
SECONDS = 6.0  # of an animation


def ffmpeg() -> str | None:
    """Path of ffmpeg: that of the system, else the one in the package imageio-ffmpeg; None without both."""
    if FFMpegWriter.isAvailable():
        return str(FFMpegWriter.bin_path())
    if importlib.util.find_spec("imageio_ffmpeg") is None:
        return None
    import imageio_ffmpeg

    try:
        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except RuntimeError:  # the package comes without a binary on some platforms
        return None


def default_movie() -> str:
    """The kind of animation if none is asked for: an MP4 where ffmpeg is found, else a GIF."""
    return "mp4" if ffmpeg() is not None else "gif"


@dataclass(frozen=True)
class Movie:
    """What an animation shows.

    Attributes:
        stem: Name of the file, without its ending.
        views: The frames.
        layers: The fields, with the values of every frame.
        titles: A title for each frame.
        parts: What holds for all of them.
    """

    stem: str
    views: Sequence[View]
    layers: Sequence[Layer]
    titles: Sequence[str]
    parts: Sequence[str]


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
    count = frame_count(directory)
    if count < 2:
        allowed = f"must be left out: {directory} has {'one frame' if count else 'no frame'} of fields"
        raise InputError("--animate", "", None, allowed)
    frames = [read_frame(directory, i) for i in range(count)]
    case = read_case(directory / "case.yaml")
    views = views_of(frames)
    names = chosen_fields(field, frames[-1], str(directory / "fields.xdmf"))
    sets = {f"field-{name}": [layer_of(name, FIELDS[name], views)] for name in names}
    parts = case_parts(case, {"d0"} if curve else ())
    titles = [title_of(frame, curve) for frame in frames]
    movies = [
        Movie(stem, views, layers, titles, parts) for stem, layers in (sets or {"fields": motion_of(views)}).items()
    ]
    return [_write(movie, kind, out, page) for movie in movies for kind in page.formats]


def _write(movie: Movie, kind: str, out: Path, page: Page) -> Path:
    """Write one animation; the file appears whole."""
    make_folder(out)
    path = out / f"{movie.stem}.{kind}"
    rate = max(2, round(len(movie.views) / SECONDS))
    figure = page.figure(view_height(page, movie.views[0]) + bar_height(page) * len(movie.layers) + 15.5)
    axis = figure.subplots()
    scaled = [(layer, scale_of(layer, movie.views)) for layer in movie.layers]
    for layer, scale in scaled:
        add_bar(figure, [axis], layer, scale)
    small_print(figure, movie.parts)
    with picture_file(path) as part, mpl.rc_context({"animation.ffmpeg_path": ffmpeg() or "ffmpeg"}):
        writer: AbstractMovieWriter = FFMpegWriter(fps=rate) if kind == "mp4" else PillowWriter(fps=rate)
        with writer.saving(figure, str(part), DPI):
            for place, (view, title) in enumerate(zip(movie.views, movie.titles, strict=True)):
                axis.clear()
                draw_view(axis, view, place, scaled)
                axis.set(xlabel=rf"$z\ [{LENGTH}]$", title=title)
                writer.grab_frame()
    return path

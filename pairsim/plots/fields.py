"""Pictures of fields.xdmf: of a run at its first and last time, of a curve at its distances; animations."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter

from pairsim.plots.field_values import FIELDS, chosen_fields
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.sections import (
    Layer,
    View,
    add_bar,
    bar_height,
    draw_sections,
    draw_view,
    layer_of,
    scale_of,
    view_height,
    views_of,
)
from pairsim.plots.style import Page, printing, small_print
from pairsim.results.columns import LENGTH, STRESS, TIME
from pairsim.results.output import make_folder, part_of
from pairsim.results.xdmf import FieldFrame, read_frame, read_times
from pairsim.runtime.errors import InputError

MOST_VIEWS = 4
MOVIE_DPI = 150
SECONDS = 6.0  # of an animation


def frame_count(directory: Path) -> int:
    """Frames of fields.xdmf, 0 without the file."""
    return len(read_times(directory)) if (directory / "fields.h5").is_file() else 0


def _shown_frames(directory: Path, curve: bool) -> list[FieldFrame]:
    """Of a run the first and the last one, of a curve some of all distances."""
    count = frame_count(directory)
    wanted = min(count, MOST_VIEWS if curve else 2)
    return [read_frame(directory, int(i)) for i in np.linspace(0, count - 1, wanted).round()]


def _title(frame: FieldFrame, curve: bool) -> str:
    return rf"$d = {frame.t:.4g}\ {LENGTH}$" if curve else rf"$t = {frame.t:.4g}\ {TIME}$"


@printing()
def draw_fields(directory: Path, out: Path, page: Page, *, curve: bool, field: str | None = None) -> list[Path]:
    """Draw `fields`: u_z in the liquid, tau_zz in soft particles; `perturbation`, or the fields that were asked for.

    Args:
        directory: Folder of a run or a curve.
        out: Folder of the pictures.
        page: What they are drawn for.
        curve: Whether it is a curve.
        field: Names of `FIELDS`, separated by commas, or "all": `field-NAME` of each in place of the others.

    Returns:
        The files written; none where there are no fields.

    Raises:
        InputError: A field is asked for that is unknown or not there.
    """
    frames = _shown_frames(directory, curve)
    if not frames:
        if field is not None:
            raise InputError("--field", "", field, f"must be left out: {directory} has no fields.h5")
        return []
    case = read_case(directory / "case.yaml")
    written: list[Path] = []
    names = chosen_fields(field, frames[-1], str(directory / "fields.xdmf"))
    if not names:
        views = views_of(frames)
        written += _save(directory, out, page, views, _motion(views, case), curve, "fields")
        extra = [name for name in ("tau_zz_extra", "pressure_extra") if FIELDS[name].there(frames[-1])]
        if len(extra) == 2 and case.get("particles", 2):
            views = views_of(frames[-1:])
            figure = _perturbation(page, views, [layer_of(name, FIELDS[name], views, case) for name in extra])
            small_print(figure, [*case_parts(case), _title(frames[-1], curve)])
            written += page.save(figure, out, "perturbation")
    for name in names:
        views = views_of(frames)
        layers = [layer_of(name, FIELDS[name], views, case)]
        written += _save(directory, out, page, views, layers, curve, f"field-{name}")
    return written


def _motion(views: Sequence[View], case: dict[str, Any]) -> list[Layer]:
    """The velocity of the liquid and, in soft particles, the axial elastic stress."""
    velocity = FIELDS["velocity"]
    label = velocity.label.replace("$u_z", "liquid: $u_z", 1)
    values = [velocity.values(view.frame, case) for view in views]
    layers = [Layer(values, label, liquid=True, solid=False, diverging=False)]
    if "tau_s" in views[-1].frame.point_data:
        stress = [view.frame.point_data["tau_s"][:, 0] for view in views]
        label = rf"particles: $\tau_{{zz}}\ [{STRESS}]$"
        layers.append(Layer(stress, label, liquid=False, solid=True, diverging=True))
    return layers


def _save(
    directory: Path, out: Path, page: Page, views: list[View], layers: list[Layer], curve: bool, stem: str
) -> list[Path]:
    figure = draw_sections(page, views, layers, [_title(view.frame, curve) for view in views])
    small_print(figure, case_parts(read_case(directory / "case.yaml"), {"d0"} if curve else ()))
    return page.save(figure, out, stem)


def _perturbation(page: Page, views: list[View], layers: list[Layer]) -> Any:
    """What the particles change in the liquid's axial stress and pressure, as in the paper's Figs. 14 and 15."""
    figure = page.figure((view_height(page, views[0]) + bar_height(page) + 6.5) * len(layers) + 6)
    axes = list(figure.subplots(len(layers), 1))
    for axis, layer in zip(axes, layers, strict=True):
        scale = scale_of(layer, views)
        draw_view(axis, views[0], 0, [(layer, scale)])
        axis.set_xlabel(rf"$z\ [{LENGTH}]$")
        add_bar(figure, [axis], layer, scale)
    return figure


@printing()
def animate(directory: Path, out: Path, page: Page, *, curve: bool, field: str | None = None) -> list[Path]:
    """Make `fields` or each `field-NAME` an animation of all frames: an MP4 where ffmpeg is found, else a GIF.

    Args:
        directory: Folder of a run or a curve.
        out: Folder of the animation.
        page: Its width.
        curve: Whether it is a curve.
        field: As in `draw_fields`.

    Raises:
        InputError: There are fewer than two frames, or the field is not there.
    """
    count = frame_count(directory)
    if count < 2:
        allowed = f"must be left out: {directory} has {'one frame' if count else 'no frame'} of fields"
        raise InputError("--animate", "", None, allowed)
    frames = [read_frame(directory, i) for i in range(count)]
    case = read_case(directory / "case.yaml")
    views = views_of(frames)
    names = chosen_fields(field, frames[-1], str(directory / "fields.xdmf"))
    sets = {f"field-{name}": [layer_of(name, FIELDS[name], views, case)] for name in names}
    sets = sets or {"fields": _motion(views, case)}
    parts = case_parts(case, {"d0"} if curve else ())
    titles = [_title(frame, curve) for frame in frames]
    return [_animate(views, layers, titles, parts, out, page, stem) for stem, layers in sets.items()]


def _animate(
    views: list[View], layers: list[Layer], titles: list[str], parts: list[str], out: Path, page: Page, stem: str
) -> Path:
    movie = FFMpegWriter.isAvailable()
    make_folder(out)
    path = out / f"{stem}.{'mp4' if movie else 'gif'}"
    part = part_of(path).with_suffix(path.suffix)  # writers go by the ending
    writer: AbstractMovieWriter = (FFMpegWriter if movie else PillowWriter)(fps=max(2, round(len(views) / SECONDS)))
    figure = page.figure(view_height(page, views[0]) + bar_height(page) * len(layers) + 15.5)
    axis = figure.subplots()
    scaled = [(layer, scale_of(layer, views)) for layer in layers]
    for layer, scale in scaled:
        add_bar(figure, [axis], layer, scale)
    small_print(figure, parts)
    try:
        with writer.saving(figure, str(part), MOVIE_DPI):
            for place, (view, title) in enumerate(zip(views, titles, strict=True)):
                axis.clear()
                draw_view(axis, view, place, scaled)
                axis.set(xlabel=rf"$z\ [{LENGTH}]$", title=title)
                writer.grab_frame()
        part.replace(path)
    except OSError as error:
        raise InputError(str(path), "-o", None, f"cannot be written ({error.strerror or error})") from error
    finally:
        with suppress(OSError):  # on a file system that is read-only
            part.unlink(missing_ok=True)
    return path

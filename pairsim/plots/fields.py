"""Pictures of fields.xdmf: of a run at its first and last time, of a curve at its distances."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

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
from pairsim.results.xdmf import FieldFrame, read_frame, read_times
from pairsim.runtime.errors import InputError

MOST_VIEWS = 4


def frame_count(directory: Path) -> int:
    """Frames of fields.xdmf, 0 without the file."""
    return len(read_times(directory))


def _shown_frames(directory: Path, curve: bool) -> list[FieldFrame]:
    """Of a run the first and the last one, of a curve some of all distances."""
    count = frame_count(directory)
    wanted = min(count, MOST_VIEWS if curve else 2)
    return [read_frame(directory, int(i)) for i in np.linspace(0, count - 1, wanted).round()]


def title_of(frame: FieldFrame, curve: bool) -> str:
    """The time of a frame of a run, or the distance of one of a curve."""
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
            raise InputError("--field", "", field, f"must be left out: {directory} has no fields.xdmf")
        return []
    case = read_case(directory / "case.yaml")
    written: list[Path] = []
    names = chosen_fields(field, frames[-1], str(directory / "fields.xdmf"))
    if not names:
        views = views_of(frames)
        written += _save(directory, out, page, views, motion_of(views), curve, "fields")
        extra = [name for name in ("tau_zz_extra", "pressure_extra") if FIELDS[name].there(frames[-1])]
        if len(extra) == 2 and case.get("particles", 2):
            views = views_of(frames[-1:])
            figure = _perturbation(page, views, [layer_of(name, FIELDS[name], views) for name in extra])
            small_print(figure, [*case_parts(case), title_of(frames[-1], curve)])
            written += page.save(figure, out, "perturbation")
    for name in names:
        views = views_of(frames)
        layers = [layer_of(name, FIELDS[name], views)]
        written += _save(directory, out, page, views, layers, curve, f"field-{name}")
    return written


def motion_of(views: Sequence[View]) -> list[Layer]:
    """The velocity of the liquid and, in soft particles, the axial elastic stress."""
    velocity = FIELDS["velocity"]
    label = velocity.label.replace("$u_z", "liquid: $u_z", 1)
    values = [velocity.values(view.frame) for view in views]
    layers = [Layer(values, label, liquid=True, solid=False, diverging=False)]
    if "tau_s" in views[-1].frame.point_data:
        stress = [view.frame.point_data["tau_s"][:, 0] for view in views]
        label = rf"particles: $\tau_{{zz}}\ [{STRESS}]$"
        layers.append(Layer(stress, label, liquid=False, solid=True, diverging=True))
    return layers


def _save(
    directory: Path, out: Path, page: Page, views: list[View], layers: list[Layer], curve: bool, stem: str
) -> list[Path]:
    figure = draw_sections(page, views, layers, [title_of(view.frame, curve) for view in views])
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

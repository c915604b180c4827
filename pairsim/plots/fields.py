"""Pictures and animations of fields.xdmf: of a run over time, of a curve over distances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from pairsim.plots.chart import small_print
from pairsim.plots.frames import FIELDS, chosen_fields
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.sections import Layer, View, draw_view, layer_of, mark_view, sheet, views_of
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.record.columns import CA_E, DE, DISTANCE, WAY_COLUMNS
from pairsim.record.folder import FIELDS_XDMF, WAY, write_file
from pairsim.record.table_files import read_table
from pairsim.record.xdmf import read_frame, read_times
from pairsim.runtime.errors import Argument, InputError
from pairsim.runtime.text import counted

MOST_VIEWS = 4
DPI, SECONDS = 150, 6.0  # of an animation


@printing()
def draw_fields(
    directory: Path, out: Path, page: Page, *, curve: bool, field: str | None = None, animated: bool = False
) -> list[Path]:
    """Draw `fields`: what particles change in the liquid, and the stress in them; or the fields that were asked for.

    The first and the last time of a run are drawn, or some of the distances of a curve; an animation is a GIF of all.
    With `field`, names of `FIELDS` separated by commas or "all", the picture `field-NAME` of each takes the place of
    `fields`. No file is written where there are no fields and none are asked for.

    Raises:
        InputError: A field is asked for that is unknown or not there, or an animation of fewer than two frames.
    """
    count = len(read_times(directory))
    if (animated and count < 2) or (field is not None and not count):
        key = "fields, a list of distances," if curve else "output: {fields: true}"
        frames = f"{counted(count, 'frame')} of fields"
        allowed = f"must be left out: {directory} has {frames}, which {key} in its case writes"
        raise InputError(Argument("animate" if animated else "field"), "", field, allowed)
    if not count:
        return []
    most = count if animated else MOST_VIEWS if curve else 2
    units = Units.of(directory, page.physical)
    found = [read_frame(directory, int(i)) for i in np.linspace(0, count - 1, min(count, most)).round()]
    views = views_of(found, units, curve)
    parts = _parts(directory, [frame.t for frame in found], curve, units.scales is not None)
    written: list[Path] = []
    for stem, layers in _pictures(directory, views, units, field).items():
        first = 0 if curve else len(views) // 2
        figure, axes, scaled = sheet(page, views, layers, 1 if animated else len(views), first)
        if page.legend:
            small_print(figure, parts)
        if animated:
            written.append(out / f"{stem}.gif")
            _write_animation(written[-1], figure, views, scaled)
            continue
        for place, axis in enumerate(axes):
            draw_view(axis, views[place], place, scaled)
            mark_view(axis, views[place])
        written += page.save(figure, out, stem)
    return written


def _parts(directory: Path, drawn: Sequence[float], curve: bool, physical: bool) -> list[str]:
    """The parameters of the case, or of the last solution on the way to it if that is one of the frames drawn."""
    case = read_case(directory / "case.yaml")
    last = read_table(directory / WAY, WAY_COLUMNS, missing_ok=True).where(slice(-1, None))
    d = min((float(each[0]) for each in last.each(DISTANCE).values() if len(each)), default=np.nan)
    if not np.isclose(drawn, d).any():
        return case_parts(case, {"d0"} if curve else (), physical)
    factor = float(last[CA_E][0]) / softest if (softest := max(case.Ca_es)) else 0.0
    reached = case.softened(float(last[DE][0]), factor)
    return ["the last steady state that was found", *case_parts(reached, {"d0"})]


def _pictures(directory: Path, views: Sequence[View], units: Units, field: str | None) -> dict[str, list[Layer]]:
    """The layers of each picture by its name, as in `draw_fields`."""
    if field is None:
        return {"fields": _motion(views, units)}
    names = chosen_fields(field, views[-1].frame, str(directory / FIELDS_XDMF))
    return {f"field-{name}": [layer_of(name, views, units)] for name in names}


def _motion(views: Sequence[View], units: Units) -> list[Layer]:
    """What the particles change in the liquid, and the axial elastic stress in soft ones; without any, the velocity.

    The disturbance of the velocity is above the axis, that of the polymer's stress, or else of the pressure, below it.
    """
    frame = views[-1].frame
    if not views[-1].particles:
        return [layer_of("velocity", views, units)]
    layers = [layer_of("velocity_extra", views, units)]
    lower = next((name for name in ("tau_zz_extra", "pressure_extra") if FIELDS[name].there(frame)), None)
    if lower is not None:
        both = layers[0], layer_of(lower, views, units)
        sides = zip(both, ("above", "below"), (1, -1), strict=True)
        layers = [replace(layer, label=f"{word}: {layer.label}", sides=(side,)) for layer, word, side in sides]
    if "tau_s" in frame.point_data:
        stress = layer_of("tau_zz", views, units)
        layers.append(replace(stress, label=f"particles: {stress.label}", liquid=False))
    return layers


def _write_animation(path: Path, figure: Figure, views: Sequence[View], scaled: Sequence[tuple[Layer, Any]]) -> None:
    """Write an animation of all views in the first panel of a figure."""
    axis, frames = figure.axes[0], []
    figure.set_dpi(DPI)
    for place, view in enumerate(views):
        axis.clear()
        draw_view(axis, view, place, scaled)
        mark_view(axis, view)
        axis.set_xlabel(view.label("z"))
        figure.canvas.draw()
        frames.append(Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB"))  # type: ignore[attr-defined]
    duration = min(500.0, 1e3 * SECONDS / len(views))  # [ms]
    frames[0].save(content := BytesIO(), "GIF", save_all=True, append_images=frames[1:], duration=duration, loop=0)
    write_file(path, content.getvalue())

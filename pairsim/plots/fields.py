"""Pictures of fields.xdmf: of a run at its first and last time, of a curve at its distances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pairsim.plots.chart import small_print
from pairsim.plots.field_values import FIELDS, chosen_fields
from pairsim.plots.labels import case_parts, read_case
from pairsim.plots.sections import Layer, View, draw_view, layer_of, mark_view, sheet, views_of
from pairsim.plots.style import Page, printing
from pairsim.plots.units import Units
from pairsim.results.columns import suffixes_in
from pairsim.results.folder import WAY
from pairsim.results.table_files import read_table
from pairsim.results.xdmf import read_frame, read_times
from pairsim.runtime.errors import InputError

MOST_VIEWS = 4


@printing()
def draw_fields(directory: Path, out: Path, page: Page, *, curve: bool, field: str | None = None) -> list[Path]:
    """Draw `fields`: what particles change in the liquid, and the stress in them; or the fields that were asked for.

    Of a run the first and the last time, of a curve some of all distances.

    Args:
        directory: Folder of a run or a curve.
        out: Folder of the pictures.
        page: What they are drawn for.
        curve: Whether it is a curve.
        field: Names of `FIELDS`, separated by commas, or "all": `field-NAME` of each in place of `fields`.

    Returns:
        The files written; none where there are no fields.

    Raises:
        InputError: A field is asked for that is unknown or not there.
    """
    count = len(read_times(directory))
    if not count:
        if field is not None:
            key = "fields, a list of distances," if curve else "output: {fields: true}"
            allowed = f"must be left out: {directory} has no fields.xdmf, which {key} in its case writes"
            raise InputError("--field", "", field, allowed)
        return []
    shown = np.linspace(0, count - 1, min(count, MOST_VIEWS if curve else 2)).round()
    units = Units.of(directory, page.physical)
    views = views_of([read_frame(directory, int(i)) for i in shown], units, curve)
    first = 0 if curve else len(views) // 2
    written: list[Path] = []
    for stem, layers in pictures_of(directory, views, field).items():
        figure, axes, scaled = sheet(page, views, layers, len(views), first)
        for place, axis in enumerate(axes):
            draw_view(axis, views[place], place, scaled)
            mark_view(axis, views[place])
        small_print(figure, _parts(directory, views, curve))
        written += page.save(figure, out, stem)
    return written


def _parts(directory: Path, views: Sequence[View], curve: bool) -> list[str]:
    """The parameters of the case, or of the last solution on the way to it where this is what is drawn."""
    case, way = read_case(directory / "case.yaml"), directory / WAY
    last = {name: values[-1] for name, values in read_table(way, missing_ok=True).items()}
    d = min((last[f"d{gap}"] for gap in suffixes_in(last, "d")), default=np.nan)
    if not any(np.isclose(view.frame.t, d) for view in views):
        return case_parts(case, {"d0"} if curve else ())
    factor = last["Ca_e"] / softest if (softest := np.max(case["Ca_e"])) else 0.0
    reached = {"De": float(last["De"]), "Ca_e": (factor * np.array(case["Ca_e"])).tolist()}
    return ["the last steady state that was found", *case_parts(case | reached, {"d0"})]


def pictures_of(directory: Path, views: Sequence[View], field: str | None) -> dict[str, list[Layer]]:
    """The layers of each picture by its name, as in `draw_fields`."""
    names = chosen_fields(field, views[-1].frame, str(directory / "fields.xdmf"))
    if not names:
        return {"fields": _motion(views)}
    return {f"field-{name}": [layer_of(name, FIELDS[name], views)] for name in names}


def _motion(views: Sequence[View]) -> list[Layer]:
    """What the particles do to the liquid, and the axial elastic stress in soft ones; without particles the velocity.

    Above the axis the disturbance of the velocity, below it that of the polymer's stress, or else of the pressure.
    """
    frame = views[-1].frame
    if not views[-1].particles:
        return [layer_of("velocity", FIELDS["velocity"], views)]
    upper = layer_of("velocity_extra", FIELDS["velocity_extra"], views)
    layers = [upper]
    for name in ("tau_zz_extra", "pressure_extra"):
        if FIELDS[name].there(frame):
            lower = layer_of(name, FIELDS[name], views)
            layers = [replace(upper, label=f"above: {upper.label}", sides=(1,))]
            layers += [replace(lower, label=f"below: {lower.label}", sides=(-1,))]
            break
    if "tau_s" in frame.point_data:
        stress = layer_of("tau_zz", FIELDS["tau_zz"], views)
        layers.append(replace(stress, label=f"particles: {stress.label}", liquid=False))
    return layers

"""A frame of fields as a grid of pyvista."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pyvista as pv

from pairsim.record.xdmf import ELASTIC, OF_LIQUID, unit_of_field

if TYPE_CHECKING:
    from pairsim.quantities.scales import Scales
    from pairsim.record.xdmf import FieldFrame


def grid_of(frame: FieldFrame, scales: Scales | None) -> pv.UnstructuredGrid:
    """The fields on the deformed mesh, in the units of an experiment if there are scales; see `Result.fields`."""
    fields = {name: values * unit_of_field(name).factor(scales) for name, values in frame.stored.items()}
    in_liquid = np.isin(np.arange(len(frame.points)), frame.cells[frame.region == 0])
    for name in fields:
        if name.startswith((ELASTIC, *OF_LIQUID)):
            fields[name][in_liquid == name.startswith(ELASTIC)] = np.nan
    grid = pv.UnstructuredGrid({pv.CellType.QUADRATIC_TRIANGLE: frame.cells}, fields.pop("position"))
    grid.point_data.update(fields)
    grid.cell_data["region"] = frame.region
    grid.field_data["t"] = [frame.t]
    return grid

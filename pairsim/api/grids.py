"""Convert fields to pyvista grids."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from pairsim.results.xdmf import FieldFrame, components

VTK_CELLS = {6: 22, 9: 28}
"""VTK cell types by number of nodes: quadratic triangles and biquadratic quadrilaterals."""


def grid_of(frame: FieldFrame) -> pv.UnstructuredGrid:
    """Convert a frame to a grid, with names and components as in fields.xdmf: vectors are (z, r, 0).

    Args:
        frame: The fields at one time.

    Returns:
        A grid of quadratic cells. Cell data: `region`, 0 in the liquid and i in particle i from upstream. Field data:
        `t`, the time [D_c/U_av], for a curve the distance [D_c].
    """
    count, nodes = frame.cells.shape
    cells = np.column_stack([np.full(count, nodes), frame.cells])
    points = np.pad(frame.points, ((0, 0), (0, 1)))
    grid = pv.UnstructuredGrid(cells.ravel(), np.full(count, VTK_CELLS[nodes], np.uint8), points)
    for name, values in frame.point_data.items():
        for part, array in components(values, name).items():
            grid.point_data[part] = array
    grid.cell_data["region"] = frame.region
    grid.field_data["t"] = [frame.t]
    return grid

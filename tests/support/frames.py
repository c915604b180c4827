"""Frames of fields as other programs read them."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pyvista

from pairsim.record.xdmf import FieldFrame, read_frame, read_times

KIND = pyvista.CellType.QUADRATIC_TRIANGLE


def assert_frame(found: FieldFrame, frame: FieldFrame) -> None:
    """A frame that was read is one that was written, to the last bit."""
    assert found.t == frame.t
    for name in ("points", "cells", "region"):
        assert np.array_equal(getattr(found, name), getattr(frame, name))
    assert set(found.point_data) == set(frame.point_data)
    for name, values in frame.point_data.items():
        assert np.array_equal(found.point_data[name], values)


def frames_everywhere(folder: Path) -> list[FieldFrame]:
    """The frames of a folder, once pyvista and meshio have shown the same: times, deformed points, cells, all fields.

    The order of times is not that of reading, so that nothing may be left over from the time before.
    """
    times = read_times(folder)
    frames = [read_frame(folder, k) for k in range(len(times))]
    if not frames:
        assert not (folder / "fields.xdmf").exists()
        return frames
    assert list(times) == sorted({frame.t for frame in frames})
    opened = pyvista.get_reader(folder / "fields.xdmf")
    assert list(opened.time_values) == list(times)
    with meshio.xdmf.TimeSeriesReader(folder / "fields.xdmf") as reader:
        assert reader.num_steps == len(frames)
        for k in [*range(1, len(frames), 2), *range(0, len(frames), 2)]:
            frame = frames[k]
            opened.set_active_time_value(frame.t)
            grid = opened.read()
            assert set(grid.celltypes) == {KIND}
            assert np.array_equal(grid.cells_dict[KIND], frame.cells)
            assert np.array_equal(grid.points[:, :2], frame.points)
            assert np.array_equal(grid.cell_data["region"], frame.region)
            reader.mesh_grid = reader.collection[k]
            points, cells = reader.read_points_cells()
            t, point_data, cell_data = reader.read_data(k)
            assert (t, cells[0].type) == (frame.t, "triangle6")
            assert np.array_equal(points[:, :2], frame.points)
            assert np.array_equal(cells[0].data, frame.cells)
            assert np.array_equal(cell_data["region"][0], frame.region)
            assert np.array_equal(point_data["position"], points)
            assert set(point_data) == set(grid.point_data) == set(frame.stored)
            for name, values in frame.stored.items():
                assert np.array_equal(grid[name], values)
                assert np.array_equal(point_data[name], values)
    return frames

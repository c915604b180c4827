"""fields.xdmf: what was written is what pyvista and meshio show, on the deformed mesh of every time."""

from __future__ import annotations

from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
import pyvista
from support.field_samples import scene

from pairsim.results.fields_writer import FieldsWriter, gather_frames
from pairsim.results.xdmf import FieldFrame, read_frame, read_times
from pairsim.runtime.errors import InputError

SHAPES = [(0.20, 0.20), (0.21, 0.195), (0.23, 0.187)]  # half axes of both particles at each time
VTK_TYPE = {6: pyvista.CellType.QUADRATIC_TRIANGLE, 9: pyvista.CellType.BIQUADRATIC_QUAD}


def sequence(kind: int) -> list[FieldFrame]:
    """Three times; the mesh is another one at the last."""
    frames = []
    for k, (a, b) in enumerate(SHAPES):
        shapes = [(-0.3 + 0.05 * k, a, b), (0.3 + 0.05 * k, a, b)]
        frames.append(scene(0.1 * (k + 1), shapes, mesh_id=k // 2, kind=kind, rays=(8, 8, 10)[k]))
    return frames


@pytest.fixture(params=[6, 9], ids=["triangles", "quadrilaterals"])
def frames(request: pytest.FixtureRequest) -> list[FieldFrame]:
    return sequence(request.param)


@pytest.fixture(params=[False, True], ids=["at work", "ended"])
def folder(request: pytest.FixtureRequest, frames: list[FieldFrame], tmp_path: Path) -> Path:
    writer = FieldsWriter(tmp_path)
    for frame in frames:
        writer.write(frame)
    if request.param:
        gather_frames(tmp_path)
    return tmp_path


def extents(points: np.ndarray, cells: np.ndarray, region: np.ndarray, particle: int) -> tuple[float, float]:
    """Axial extent and largest radius of a particle."""
    nodes = points[np.unique(cells[region == particle])]
    return float(np.ptp(nodes[:, 0])), float(nodes[:, 1].max())


def test_frames_come_back_as_they_were_given(frames: list[FieldFrame], folder: Path) -> None:
    assert read_times(folder).tolist() == [frame.t for frame in frames]
    for k, frame in enumerate(frames):
        back = read_frame(folder, k)
        assert (back.t, back.mesh_id) == (frame.t, frame.mesh_id)
        for name in ("points", "cells", "region"):
            assert np.array_equal(getattr(back, name), getattr(frame, name))
        assert set(back.point_data) == set(frame.point_data)
        for name, values in frame.point_data.items():
            assert np.array_equal(back.point_data[name], values)


def test_pyvista_shows_every_time_deformed(frames: list[FieldFrame], folder: Path) -> None:
    reader = pyvista.get_reader(folder / "fields.xdmf")
    assert list(reader.time_values) == [frame.t for frame in frames]
    for index in (2, 0, 1):  # any order: nothing may be left over from the time before
        frame, (a, b) = frames[index], SHAPES[index]
        reader.set_active_time_value(frame.t)
        grid = reader.read()
        kind = frame.cells.shape[1]
        assert set(grid.celltypes) == {VTK_TYPE[kind]}
        assert np.array_equal(grid.cells_dict[VTK_TYPE[kind]], frame.cells)
        assert np.array_equal(grid.points[:, :2], frame.points)
        region = grid.cell_data["region"]
        assert np.array_equal(region, frame.region)
        for particle in (1, 2):
            assert extents(grid.points, frame.cells, region, particle) == pytest.approx((2 * a, b), rel=1e-12)
        assert np.array_equal(grid["velocity"][:, :2], frame.point_data["velocity"])
        assert np.array_equal(grid["pressure"], frame.point_data["pressure"])
        for i, part in enumerate(("zz", "zr", "rr", "tt")):
            assert np.array_equal(grid[f"tau_s_{part}"], frame.point_data["tau_s"][:, i])


def test_meshio_time_series_shows_every_time_deformed(frames: list[FieldFrame], folder: Path) -> None:
    with meshio.xdmf.TimeSeriesReader(folder / "fields.xdmf") as reader:
        assert reader.num_steps == len(frames)
        points, _ = reader.read_points_cells()
        assert np.array_equal(points[:, :2], frames[0].points)
        for k, (frame, (a, b)) in enumerate(zip(frames, SHAPES, strict=True)):
            reader.mesh_grid = reader.collection[k]
            points, cells = reader.read_points_cells()
            t, point_data, cell_data = reader.read_data(k)
            assert t == frame.t
            assert cells[0].type == {6: "triangle6", 9: "quad9"}[frame.cells.shape[1]]
            for particle in (1, 2):
                found = extents(points, cells[0].data, cell_data["region"][0], particle)
                assert found == pytest.approx((2 * a, b), rel=1e-12)
            assert np.array_equal(point_data["position"], points)
            assert np.array_equal(point_data["displacement"][:, :2], frame.point_data["displacement"])


def test_meshio_read_shows_the_last_time_deformed(frames: list[FieldFrame], folder: Path) -> None:
    mesh = meshio.read(folder / "fields_last.xdmf")
    found = extents(mesh.points, mesh.cells[0].data, mesh.cell_data["region"][0], 2)
    assert found == pytest.approx((2 * SHAPES[-1][0], SHAPES[-1][1]), rel=1e-12)
    assert np.array_equal(mesh.point_data["tau_s_zz"], frames[-1].point_data["tau_s"][:, 0])


def test_meshes_are_stored_once_and_no_other_files_are_left(folder: Path) -> None:
    stored = []
    for file in [*folder.glob("fields/*"), *folder.glob("fields.h5")]:
        with h5py.File(file) as h5:
            stored += [group.name for kind in h5.values() for group in kind.values()]
    assert sorted(stored) == [*(f"/frames/00000{k}" for k in range(3)), "/mesh/000000", "/mesh/000001"]
    data = "fields.h5" if (folder / "fields.h5").exists() else "fields"
    assert sorted(file.name for file in folder.iterdir()) == [data, "fields.xdmf", "fields_last.xdmf"]


def test_frames_can_be_read_while_the_run_goes_on(tmp_path: Path) -> None:
    writer = FieldsWriter(tmp_path)
    for k, frame in enumerate(sequence(6), 1):
        writer.write(frame)
        assert len(read_times(tmp_path)) == k
        assert pyvista.get_reader(tmp_path / "fields.xdmf").number_time_points == k


def test_new_writer_replaces_an_earlier_run(folder: Path) -> None:
    FieldsWriter(folder).write(sequence(6)[0])
    assert len(read_times(folder)) == 1
    assert not (folder / "fields.h5").exists()
    assert [file.name for file in folder.glob("fields/*")] == ["000000.h5"]


def test_rigid_scene_and_empty_tube_are_written(tmp_path: Path) -> None:
    for frame in (scene(0.0, [(0.0, 0.2, 0.2)], rigid=True), scene(0.0, [])):
        FieldsWriter(tmp_path).write(frame)
        assert set(read_frame(tmp_path).point_data) == {"velocity", "pressure"}
        grid = pyvista.get_reader(tmp_path / "fields.xdmf").read()
        assert grid.n_cells == len(frame.cells)


def broken(**changes: object) -> FieldFrame:
    frame = scene(0.5, [(0.0, 0.2, 0.2)])
    return FieldFrame(**{**{name: getattr(frame, name) for name in frame.__dataclass_fields__}, **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"t": float("nan")}, "t is not finite"),
        ({"t": 0.1}, "after one at"),
        ({"point_data": {"pressure": np.full(len(broken().points), np.nan)}}, "pressure is not finite"),
        ({"cells": broken().cells[1:], "region": broken().region[1:]}, "another topology"),
        ({"cells": broken().cells[::-1]}, "another topology"),
    ],
)
def test_inconsistent_frame_is_refused_and_the_file_stays(
    tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    writer = FieldsWriter(tmp_path)
    writer.write(scene(0.25, [(0.0, 0.2, 0.2)]))
    with pytest.raises(ValueError, match=message):
        writer.write(broken(**changes))
    assert read_times(tmp_path).tolist() == [0.25]
    assert pyvista.get_reader(tmp_path / "fields.xdmf").number_time_points == 1


def test_what_cannot_be_read_is_an_input_error(folder: Path, tmp_path: Path) -> None:
    assert read_times(tmp_path / "empty").size == 0
    with pytest.raises(InputError, match="frame"):
        read_frame(folder, 3)
    for file in [*folder.glob("fields/000001.h5"), *folder.glob("fields.h5")]:
        file.write_bytes(file.read_bytes()[:1000])
    with pytest.raises(InputError, match="readable file with fields"):
        read_frame(folder, 1)
    (folder / "fields.xdmf").write_text("<Xdmf>")
    with pytest.raises(InputError, match="readable file with fields"):
        read_times(folder)

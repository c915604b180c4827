"""fields.xdmf: what was written is what pyvista and meshio show, on the deformed mesh of every time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyvista
from support.field_samples import scene
from support.frames import assert_frame, frames_everywhere

from pairsim.record.xdmf import FieldFrame, FieldsWriter, read_frame, read_times
from pairsim.runtime.errors import InputError

SHAPES = [(0.20, 0.20), (0.21, 0.195), (0.23, 0.187)]  # half axes of both particles at each time


def sequence() -> list[FieldFrame]:
    """Three times; the mesh is another one at the last."""
    frames = []
    for k, (a, b) in enumerate(SHAPES):
        shapes = [(-0.3 + 0.05 * k, a, b), (0.3 + 0.05 * k, a, b)]
        frames.append(scene(0.1 * (k + 1), shapes, rays=(8, 8, 10)[k]))
    return frames


def written(folder: Path, frames: list[FieldFrame]) -> Path:
    writer = FieldsWriter(folder)
    for frame in frames:
        writer.write(frame)
    return folder


def test_frames_are_shown_as_they_were_given_also_after_the_folder_was_moved(tmp_path: Path) -> None:
    frames = sequence()
    (tmp_path / "here").mkdir()
    folder = written(tmp_path / "here", frames).rename(tmp_path / "there")
    found = frames_everywhere(folder)
    for one, frame in zip(found, frames, strict=True):
        assert_frame(one, frame)
    for one, (a, b) in zip(found, SHAPES, strict=True):
        for particle in (1, 2):
            nodes = one.points[np.unique(one.cells[one.region == particle])]
            assert (np.ptp(nodes[:, 0]), nodes[:, 1].max()) == pytest.approx((2 * a, b), rel=1e-12)
    files = {str(file.relative_to(folder)) for file in folder.rglob("*.*")}
    assert files == {"fields.xdmf", "fields/0000.h5", "fields/0001.h5", "fields/0002.h5"}


def test_frames_can_be_read_while_others_are_written_in_any_order(tmp_path: Path) -> None:
    writer, frames = FieldsWriter(tmp_path), sequence()
    for count, k in enumerate((2, 0, 1), 1):
        writer.write(frames[k])
        assert len(frames_everywhere(tmp_path)) == count
    writer.write(frames[1])
    assert read_times(tmp_path).tolist() == [frame.t for frame in frames]


def test_a_new_writer_replaces_earlier_frames_but_for_the_first_ones(tmp_path: Path) -> None:
    frames = sequence()
    index = [(written(tmp_path, frames[:k]) / "fields.xdmf").read_text() for k in (1, 2, 3)]
    (tmp_path / "fields" / ".0003.h5.part").touch()
    writer = FieldsWriter(tmp_path, keep=2)
    assert (tmp_path / "fields.xdmf").read_text() == index[1]
    assert sorted(file.name for file in (tmp_path / "fields").iterdir()) == ["0000.h5", "0001.h5"]
    writer.write(frames[2])
    assert (tmp_path / "fields.xdmf").read_text() == index[2]
    written(tmp_path, frames[:1])
    assert (tmp_path / "fields.xdmf").read_text() == index[0]
    assert [file.name for file in (tmp_path / "fields").iterdir()] == ["0000.h5"]


def test_rigid_scene_and_empty_tube_are_written(tmp_path: Path) -> None:
    for frame in (scene(0.0, [(0.0, 0.2, 0.2)], rigid=True), scene(0.0, [])):
        written(tmp_path, [frame])
        assert set(read_frame(tmp_path).point_data) == {"velocity", "pressure"}
        assert pyvista.get_reader(tmp_path / "fields.xdmf").read().n_cells == len(frame.cells)


def test_a_frame_with_an_unknown_number_is_refused_and_the_others_stay(tmp_path: Path) -> None:
    writer, (first, second, _) = FieldsWriter(tmp_path), sequence()
    writer.write(first)
    second.point_data["pressure"][3] = np.nan
    with pytest.raises(ValueError, match="pressure is not finite"):
        writer.write(second)
    assert len(frames_everywhere(tmp_path)) == 1


def test_what_cannot_be_read_is_an_input_error(tmp_path: Path) -> None:
    assert read_times(tmp_path).size == 0
    written(tmp_path, sequence())
    with pytest.raises(InputError, match="frame"):
        read_frame(tmp_path, 3)
    file = tmp_path / "fields" / "0001.h5"
    file.write_bytes(file.read_bytes()[:1000])
    with pytest.raises(InputError, match="readable file with fields"):
        read_frame(tmp_path, 1)
    (tmp_path / "fields.xdmf").write_text("<Xdmf>")
    with pytest.raises(InputError, match="readable file with fields"):
        read_times(tmp_path)

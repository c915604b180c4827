"""Write and read fields on a moving mesh: fields.h5 with the data, fields.xdmf with their description.

Each time has its own geometry, because the mesh moves, and refers to a topology, which changes at remeshing. Only
features of XDMF are used that ParaView, pyvista (VTK) and meshio all read:

* `fields.xdmf` is a temporal collection. ParaView and pyvista show the deformed particles at every time.
  `meshio.xdmf.TimeSeriesReader` uses the mesh of the first time for all times; for another one set
  `reader.mesh_grid = reader.collection[k]` before `read_points_cells`, or take the points from the field `position`.
* `fields_last.xdmf` has the last time only, for meshio and ParaView: `meshio.read` rejects XDMF files with times, and
  pyvista rejects those without.

Vectors are stored with three components (z, r, 0), symmetric tensors as four scalars `name_zz`, `_zr`, `_rr`, `_tt`.
"""

from __future__ import annotations

import copy
import errno
import os
import shutil
import sys
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import h5py
import numpy as np
from numpy.typing import NDArray

from pairsim.results.output import replaced, write_text
from pairsim.runtime.errors import InputError

HEAD = '<?xml version="1.0" encoding="utf-8"?>\n<Xdmf Version="3.0">\n <Domain>\n'
END = "  </Grid>\n </Domain>\n</Xdmf>\n"
BLOCK = 2**20  # bytes copied at a time
TENSOR = ("zz", "zr", "rr", "tt")
TOPOLOGY = {6: "Tri_6", 9: "Quad_9"}
"""XDMF cell types by number of nodes, in the spelling that both VTK and meshio read."""


@dataclass(frozen=True)
class FieldFrame:
    """The fields at one time on the deformed mesh.

    Attributes:
        t: Time [D_c/U_av]; for a curve the distance [D_c].
        mesh_id: Number of the mesh; increases at remeshing.
        points: Coordinates z, r of the nodes of the deformed mesh [D_c], shape (n, 2).
        cells: Node numbers in the order of VTK: triangles, shape (m, 6), or quadrilaterals, shape (m, 9).
        region: 0 in the liquid, i in particle i from upstream, shape (m,).
        point_data: Scalars (n,), vectors z, r (n, 2) or symmetric tensors zz, zr, rr, tt (n, 4) by name.
    """

    t: float
    mesh_id: int
    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    region: NDArray[np.int64]
    point_data: dict[str, NDArray[np.float64]] = field(default_factory=dict)

    def check(self) -> None:
        """Check shapes and values.

        Raises:
            ValueError: Shapes are inconsistent, or a number is not finite.
        """
        n, m = len(self.points), len(self.cells)
        if self.points.shape != (n, 2):
            raise ValueError(f"points have the shape {self.points.shape}, not (n, 2)")
        if self.cells.ndim != 2 or self.cells.shape[1] not in TOPOLOGY:
            raise ValueError(f"cells have the shape {self.cells.shape}, not (m, 6) or (m, 9)")
        if self.region.shape != (m,):
            raise ValueError(f"region has the shape {self.region.shape}, not ({m},)")
        if m and not 0 <= self.cells.min() <= self.cells.max() < n:
            raise ValueError(f"cells refer to nodes outside 0..{n - 1}")
        if "position" in self.point_data:
            raise ValueError("position is the name under which the points are stored")
        for name, values in {"t": np.asarray(self.t), "points": self.points, **self.point_data}.items():
            if name in self.point_data and (values.shape[:1] != (n,) or values.shape[1:] not in ((), (2,), (4,))):
                raise ValueError(f"{name} has the shape {values.shape}, not ({n},), ({n}, 2) or ({n}, 4)")
            if not np.isfinite(values).all():
                raise ValueError(f"{name} is not finite at t = {self.t:g}")


def components(values: NDArray[np.float64], name: str) -> dict[str, NDArray[np.float64]]:
    """The arrays stored for a point field, by name; see the description of this module."""
    values = np.asarray(values, dtype=np.float64)
    if values.ndim == 1:
        return {name: values}
    if values.shape[1] == 2:
        return {name: np.pad(values, ((0, 0), (0, 1)))}
    return {f"{name}_{part}": values[:, i] for i, part in enumerate(TENSOR)}


class FieldsWriter:
    """Writes frames as they are computed. The files are complete after each frame, also if the run is killed later.

    Args:
        folder: Existing folder.
        name: File name without suffix; existing files are replaced at the first frame.
        keep: Append after this number of frames of the existing files; after none if these are damaged.

    Attributes:
        frames: Number of frames in the files.

    Raises:
        OSError: There is no disk space for a copy of the frames to keep.
    """

    def __init__(self, folder: Path | str, name: str = "fields", keep: int = 0) -> None:
        self.folder, self.name = Path(folder), name
        self.frames = 0
        self._meshes: dict[int, bytes] = {}  # digest of the topology
        self._t = -np.inf
        if keep:
            self._cut(keep)

    def _cut(self, keep: int) -> None:
        """Keep the first frames and remove the others; files that cannot be read are left unchanged."""
        path, part = self.folder / f"{self.name}.h5", self.folder / f".{self.name}.h5.part"
        if path.is_file() and shutil.disk_usage(self.folder).free < path.stat().st_size:
            raise OSError(errno.ENOSPC, "No space left for a copy of the frames to keep", str(path))
        try:
            grids, meshes = self._grids(keep), {}
            with h5py.File(path, "r", locking=False) as old, h5py.File(part, "w", libver="earliest") as new:
                for index in range(keep):
                    key = f"frames/{index:06d}"
                    number, t = int(old[key].attrs["mesh_id"]), float(old[key].attrs["t"])
                    old.copy(key, new.require_group("frames"))
                    if number not in meshes:
                        mesh = old[f"mesh/{number:06d}"]
                        old.copy(mesh, new.require_group("mesh"))
                        meshes[number] = _digest(mesh["cells"][()], mesh["region"][()])
        except (OSError, KeyError, RuntimeError):
            part.unlink(missing_ok=True)
            return
        part.replace(path)
        self._describe(grids)
        self.frames, self._meshes, self._t = keep, meshes, t

    def write(self, frame: FieldFrame) -> None:
        """Append a frame.

        Raises:
            ValueError: The frame is inconsistent or not finite, its time is not after that of the last frame, or its
                topology differs from that of an earlier frame with the same `mesh_id`.
            OSError: The files cannot be written.
        """
        frame.check()
        if frame.t <= self._t:
            raise ValueError(f"frame at t = {frame.t:g} after one at t = {self._t:g}")
        cells = np.ascontiguousarray(frame.cells, dtype=np.int64)
        region = np.ascontiguousarray(frame.region, dtype=np.int64)
        digest = _digest(cells, region)
        if self._meshes.get(frame.mesh_id, digest) != digest:
            raise ValueError(f"mesh {frame.mesh_id} had another topology before")
        grid = ElementTree.Element("Grid", Name=f"t = {frame.t:.6g}", GridType="Uniform")
        ElementTree.SubElement(grid, "Time", Value=repr(float(frame.t)))
        path = self.folder / f"{self.name}.h5"
        if not self.frames:
            with _append(path, "w"):
                pass
        _reserve(path, frame)
        with _append(path, "a") as h5:
            self._write_mesh(h5, grid, frame, cells)
            self._write_fields(h5, grid, frame)
        self._meshes[frame.mesh_id], self._t = digest, frame.t
        self._describe([grid])
        self.frames += 1

    def _item(self, parent: ElementTree.Element, data: h5py.Dataset) -> None:
        """Add a reference to a dataset of the HDF5 file."""
        attributes = {
            "DataType": "Int" if data.dtype.kind == "i" else "Float",
            "Precision": str(data.dtype.itemsize),
            "Dimensions": " ".join(map(str, data.shape)),
            "Format": "HDF",
        }
        ElementTree.SubElement(parent, "DataItem", attributes).text = f"{self.name}.h5:{data.name}"

    def _attribute(self, grid: ElementTree.Element, name: str, data: h5py.Dataset, center: str = "Node") -> None:
        kind = "Scalar" if data.ndim == 1 else "Vector"
        self._item(ElementTree.SubElement(grid, "Attribute", Name=name, AttributeType=kind, Center=center), data)

    def _write_mesh(
        self, h5: h5py.File, grid: ElementTree.Element, frame: FieldFrame, cells: NDArray[np.int64]
    ) -> None:
        mesh = h5.require_group(f"mesh/{frame.mesh_id:06d}")
        if frame.mesh_id not in self._meshes:
            mesh.clear()  # remove what an interrupted write left
            _dataset(mesh, "cells", cells)
            _dataset(mesh, "region", np.asarray(frame.region, dtype=np.int64))
        kind, count = TOPOLOGY[cells.shape[1]], str(len(cells))
        self._item(ElementTree.SubElement(grid, "Topology", TopologyType=kind, NumberOfElements=count), mesh["cells"])
        self._attribute(grid, "region", mesh["region"], "Cell")

    def _write_fields(self, h5: h5py.File, grid: ElementTree.Element, frame: FieldFrame) -> None:
        key = f"frames/{self.frames:06d}"
        if key in h5:  # left by an interrupted write
            del h5[key]
        group = h5.create_group(key)
        points = _dataset(group, "position", np.pad(np.asarray(frame.points, dtype=np.float64), ((0, 0), (0, 1))))
        self._item(ElementTree.SubElement(grid, "Geometry", GeometryType="XYZ"), points)
        self._attribute(grid, "position", points)
        for name, values in frame.point_data.items():
            for stored_name, stored in components(values, name).items():
                self._attribute(grid, stored_name, _dataset(group, stored_name, stored))
        group.attrs["mesh_id"] = frame.mesh_id
        group.attrs["t"] = frame.t  # written last: a frame without it is incomplete

    def _grids(self, count: int) -> list[ElementTree.Element]:
        """Read the descriptions of the first frames.

        Raises:
            OSError: There are fewer.
        """
        path = self.folder / f"{self.name}.xdmf"
        try:
            grids = ElementTree.parse(path).findall("Domain/Grid/Grid")[:count]
        except ElementTree.ParseError as error:
            raise OSError(errno.EIO, f"damaged ({error})", str(path)) from error
        if len(grids) < count:
            raise OSError(errno.EIO, f"damaged ({len(grids)} of {count} frames)", str(path))
        return grids

    def _describe(self, grids: list[ElementTree.Element]) -> None:
        """Append descriptions to those of the frames so far, and write the last one alone.

        Those so far are copied from file to file, as a long run has many.

        Raises:
            OSError: They cannot be written, or end otherwise than expected.
        """
        path, end = self.folder / f"{self.name}.xdmf", END.encode()
        with replaced(path) as new:
            if self.frames:
                with path.open("rb") as old:
                    old.seek(-len(end), os.SEEK_END)
                    size = old.tell()
                    if old.read() != end:
                        raise OSError(errno.EIO, "damaged (not as it was written)", str(path))
                    old.seek(0)
                    while block := old.read(min(BLOCK, size - old.tell())):
                        new.write(block)
            else:
                new.write(
                    f'{HEAD}  <Grid Name="{self.name}" GridType="Collection" CollectionType="Temporal">\n'.encode()
                )
            new.write("".join(_indented(grid, 3) for grid in grids).encode() + end)
        last = copy.deepcopy(grids[-1])
        last.remove(last[0])  # the time, which meshio.read rejects
        write_text(self.folder / f"{self.name}_last.xdmf", HEAD + _indented(last, 2) + " </Domain>\n</Xdmf>\n")


def _indented(grid: ElementTree.Element, level: int) -> str:
    """Text of a grid at a level of indentation."""
    ElementTree.indent(grid, " ", level)
    return " " * level + ElementTree.tostring(grid, encoding="unicode").rstrip() + "\n"


def _append(path: Path, mode: str) -> h5py.File:
    # No HDF5 locks: a program that has the file open must not stop the run, and some cluster file systems have none.
    return h5py.File(path, mode, libver="earliest", locking=False)


def _reserve(path: Path, frame: FieldFrame) -> None:
    """Reserve disk space for a frame, since a failed write inside HDF5 may crash the process.

    HDF5 overwrites the reserved space and truncates the file when it closes it.

    Raises:
        OSError: There is not enough space.
    """
    if sys.platform == "linux":
        arrays = (frame.points, frame.points, frame.cells, frame.region, *frame.point_data.values())
        room = sum(array.nbytes for array in arrays) * 3 // 2 + 2**17
        with path.open("ab") as file:
            os.posix_fallocate(file.fileno(), file.tell(), room)


def _digest(cells: NDArray[np.int64], region: NDArray[np.int64]) -> bytes:
    """A hash of the topology."""
    return sha256(cells.tobytes() + region.tobytes()).digest() + cells.shape[1].to_bytes()


def _dataset(group: h5py.Group, name: str, values: NDArray[Any]) -> h5py.Dataset:
    return group.create_dataset(name, data=values, compression="gzip", compression_opts=4, shuffle=True)


def _open(folder: Path | str, name: str) -> h5py.File:
    path = Path(folder) / f"{name}.h5"
    try:
        return h5py.File(path, "r", locking=False)
    except OSError as error:
        raise InputError(str(path), "", None, f"must be a readable file with fields ({error})") from error


def _finished(h5: h5py.File) -> list[h5py.Group]:
    frames = h5["frames"].values() if "frames" in h5 else ()
    return [group for group in frames if "t" in group.attrs]


def read_times(folder: Path | str, name: str = "fields") -> NDArray[np.float64]:
    """Read the times of the frames in a folder.

    Args:
        folder: Folder of the results.
        name: File name without suffix.

    Returns:
        Times [D_c/U_av] (of a curve: distances [D_c]), shape (frames,).

    Raises:
        InputError: There is no readable field file.
    """
    with _open(folder, name) as h5:
        return np.array([group.attrs["t"] for group in _finished(h5)], dtype=float)


def read_frame(folder: Path | str, index: int = -1, name: str = "fields") -> FieldFrame:
    """Read one frame, as it was passed to `FieldsWriter.write`.

    Args:
        folder: Folder of the results.
        index: Index of the frame; negative indices count from the end.
        name: File name without suffix.

    Raises:
        InputError: There is no readable field file, or no such frame in it.
    """
    with _open(folder, name) as h5:
        frames = _finished(h5)
        if not -len(frames) <= index < len(frames):
            allowed = f"must be below {len(frames)}" if frames else "must refer to a complete frame, but there are none"
            raise InputError(str(Path(folder) / f"{name}.h5"), "frame", index, allowed)
        group = frames[index]
        stored = {key: np.asarray(values[()]) for key, values in group.items()}
        mesh_id = int(group.attrs["mesh_id"])
        mesh = h5[f"mesh/{mesh_id:06d}"]
        points = stored.pop("position")[:, :2]
        data: dict[str, NDArray[np.float64]] = {}
        for key, values in stored.items():
            stem, _, part = key.rpartition("_")
            if part in TENSOR and all(f"{stem}_{other}" in stored for other in TENSOR):
                data[stem] = np.stack([stored[f"{stem}_{other}"] for other in TENSOR], axis=1)
            else:
                data[key] = values[:, :2] if values.ndim == 2 else values
        return FieldFrame(float(group.attrs["t"]), mesh_id, points, mesh["cells"][()], mesh["region"][()], data)

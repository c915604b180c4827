"""Write fields.xdmf and its data so that a frame, once written, survives whatever ends the process.

Every frame has an HDF5 file of its own, `fields/NUMBER.h5`, which also holds the mesh if the frame is the first one on
it. The file is written under a temporary name and renamed, and not changed afterwards; fields.xdmf, which refers to it,
is then replaced as a whole in the same way. So fields.xdmf refers to complete files only, at any moment. When a command
has ended, `gather_frames` copies the frames into one file, fields.h5, with the same care.
"""

from __future__ import annotations

import errno
import io
import os
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from hashlib import sha256
from itertools import chain, islice
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from pairsim.results.output import (
    FIELDS_H5,
    FIELDS_LAST,
    FIELDS_XDMF,
    FRAMES,
    frame_files,
    part_of,
    replaced,
    write_bytes,
    write_text,
)
from pairsim.results.xdmf import (
    DAMAGE,
    TOPOLOGY,
    FieldFrame,
    components,
    grids_of,
    hdf5,
    open_data,
    place_of,
)

HEAD = '<?xml version="1.0" encoding="utf-8"?>\n<Xdmf Version="3.0">\n <Domain>\n'
BEGIN = HEAD + '  <Grid Name="fields" GridType="Collection" CollectionType="Temporal">\n'
END = "  </Grid>\n </Domain>\n</Xdmf>\n"
BLOCK = 2**20  # bytes copied at a time
SEPARATE = re.compile(rb">" + FRAMES.encode() + rb"/\d+\.h5:")


class FieldsWriter:
    """Writes frames as they are computed. The files are complete after each frame, and stay so if the run is killed.

    Args:
        folder: Existing folder.
        keep: Number of frames to keep of those that the folder has; those that cannot be read are left out.
        until: Only frames up to this time [D_c/U_av] are kept.

    Attributes:
        frames: Number of frames in fields.xdmf.

    Raises:
        OSError: The files cannot be written.
    """

    def __init__(self, folder: Path | str, keep: int = 0, until: float = np.inf) -> None:
        self.folder = Path(folder)
        self.frames = 0
        self._next = 0  # number of the next file
        self._meshes: dict[int, tuple[bytes, str]] = {}  # digest of the topology, file and group
        self._t = -np.inf
        self._cut(keep, until)

    def _cut(self, keep: int, until: float) -> None:
        """Keep the first frames and remove the others, from fields.xdmf first."""
        kept = (grid for grid in islice(self._listed(), keep) if self._take(grid, until))
        if (first := next(kept, None)) is not None:
            self._describe(chain([first], kept), append=False)
        elif not keep:
            for name in (FIELDS_XDMF, FIELDS_LAST, FIELDS_H5):
                (self.folder / name).unlink(missing_ok=True)
        if self.frames or not keep:  # otherwise what cannot be read is left alone
            for number, file in frame_files(self.folder):
                if number >= self._next:
                    file.unlink()

    def _listed(self) -> Iterator[ElementTree.Element]:
        """The frames in fields.xdmf, as far as it can be read."""
        with suppress(OSError):
            yield from grids_of(self.folder / FIELDS_XDMF)

    def _take(self, grid: ElementTree.Element, until: float) -> bool:
        """Continue after a frame of the folder; returns whether it can be read and is not beyond a time."""
        with suppress(*DAMAGE):
            place = place_of(grid)
            number, mesh_id = (int(group.rpartition("/")[2]) for _, group in (place.data, place.mesh))
            if place.t > until:
                return False
            with open_data(self.folder, place.data[0]) as h5:
                for values in h5[place.data[1]].values():
                    values[-1:]  # an error if the file is damaged
            if mesh_id not in self._meshes:
                with open_data(self.folder, place.mesh[0]) as h5:
                    mesh = h5[place.mesh[1]]
                    self._meshes[mesh_id] = _digest(mesh["cells"][()], mesh["region"][()]), ":".join(place.mesh)
            self._next, self._t = number + 1, place.t
            self.frames += 1
            return True
        return False

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
        file = f"{FRAMES}/{self._next:06d}.h5"
        digest = _digest(cells, region)
        known, mesh = self._meshes.get(frame.mesh_id, (digest, f"{file}:/mesh/{frame.mesh_id:06d}"))
        if known != digest:
            raise ValueError(f"mesh {frame.mesh_id} had another topology before")
        fields = {"position": np.pad(np.asarray(frame.points, dtype=np.float64), ((0, 0), (0, 1)))}
        for name, values in frame.point_data.items():
            fields |= components(values, name)
        groups: dict[str, dict[str, NDArray[Any]]] = {f"frames/{self._next:06d}": fields}
        if frame.mesh_id not in self._meshes:
            groups[f"mesh/{frame.mesh_id:06d}"] = {"cells": cells, "region": region}
        (self.folder / FRAMES).mkdir(exist_ok=True)
        write_bytes(self.folder / file, _image(groups, {"mesh_id": frame.mesh_id, "t": frame.t}))
        grid = ElementTree.Element("Grid", Name=f"t = {frame.t:.6g}", GridType="Uniform")
        ElementTree.SubElement(grid, "Time", Value=repr(float(frame.t)))
        count = str(len(cells))
        kind = ElementTree.SubElement(grid, "Topology", TopologyType=TOPOLOGY[cells.shape[1]], NumberOfElements=count)
        _item(kind, cells, f"{mesh}/cells")
        _attribute(grid, "region", region, f"{mesh}/region", "Cell")
        where = f"{file}:/frames/{self._next:06d}"
        _item(ElementTree.SubElement(grid, "Geometry", GeometryType="XYZ"), fields["position"], f"{where}/position")
        for name, values in fields.items():
            _attribute(grid, name, values, f"{where}/{name}")
        self._describe([grid], append=self.frames > 0)
        self._meshes[frame.mesh_id], self._t = (digest, mesh), frame.t
        self._next += 1
        self.frames += 1

    def _describe(self, grids: Iterable[ElementTree.Element], append: bool) -> None:
        """Write descriptions of frames, and the last one alone; one at a time, as a long run has many.

        Args:
            grids: The descriptions, at least one.
            append: Whether they come after those in fields.xdmf.

        Raises:
            OSError: They cannot be written, or end otherwise than expected.
        """
        path, end = self.folder / FIELDS_XDMF, END.encode()
        with replaced(path) as new:
            if append:
                with path.open("rb") as old:
                    old.seek(-len(end), os.SEEK_END)
                    size = old.tell()
                    if old.read() != end:
                        raise OSError(errno.EIO, "damaged (not as it was written)", str(path))
                    old.seek(0)
                    while block := old.read(min(BLOCK, size - old.tell())):
                        new.write(block)
            else:
                new.write(BEGIN.encode())
            for grid in grids:
                new.write(_indented(grid, 3).encode())
            new.write(end)
        grid.remove(grid[0])  # the time, which meshio.read rejects
        write_text(self.folder / FIELDS_LAST, HEAD + _indented(grid, 2) + " </Domain>\n</Xdmf>\n")


def gather_frames(folder: Path) -> None:
    """Move all frames of fields.xdmf into fields.h5, so that a folder has few files.

    Raises:
        OSError: There is no room for the copy, or a frame cannot be read; everything is as before.
    """
    if not (folder / FRAMES).is_dir() or not (folder / FIELDS_XDMF).is_file():
        return
    groups: dict[str, dict[str, None]] = {}  # the groups of each file, in their order
    try:
        for place in map(place_of, grids_of(folder / FIELDS_XDMF)):
            for file, group in (place.data, place.mesh):
                groups.setdefault(file, {})[group] = None
        if set(groups) != {FIELDS_H5}:
            _copy(folder, groups)
    except OSError:
        raise
    except DAMAGE as error:
        raise OSError(errno.EIO, f"damaged ({error})", str(folder / FIELDS_XDMF)) from error
    # Both the descriptions so far and the new ones are right with the new fields.h5.
    for path in (folder / FIELDS_XDMF, folder / FIELDS_LAST):
        with path.open("rb") as old, replaced(path) as new:
            new.writelines(SEPARATE.sub(f">{FIELDS_H5}:".encode(), line) for line in old)
    for _, single in frame_files(folder):
        single.unlink()
    with suppress(OSError):  # not empty
        (folder / FRAMES).rmdir()


def _copy(folder: Path, groups: dict[str, dict[str, None]]) -> None:
    """Copy groups of several files into a new fields.h5, which replaces the old one."""
    part = part_of(folder / FIELDS_H5)
    try:
        with hdf5(part, "w", libver="earliest", locking=False):
            pass
        _reserve(part, sum((folder / file).stat().st_size for file in groups))
        with hdf5(part, "a", libver="earliest", locking=False) as new:
            for file, names in groups.items():
                with open_data(folder, file) as old:
                    for name in names:
                        old.copy(name, new.require_group(name.rpartition("/")[0]))
        with part.open("rb") as written:
            os.fsync(written.fileno())
        os.replace(part, folder / FIELDS_H5)
    except BaseException:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def _reserve(path: Path, room: int) -> None:
    """Reserve disk space, since a failed write inside HDF5 may crash the process.

    HDF5 overwrites the reserved space and truncates the file when it closes it.

    Raises:
        OSError: There is not enough space.
    """
    if sys.platform == "linux":
        with path.open("ab") as file:
            os.posix_fallocate(file.fileno(), file.tell(), room + 2**17)


def _image(groups: dict[str, dict[str, NDArray[Any]]], attributes: dict[str, float]) -> bytes:
    """The content of an HDF5 file with these groups of datasets, and attributes of the first one.

    Made in memory, since a full disk is an error in Python, but may crash HDF5.
    """
    buffer = io.BytesIO()
    with hdf5(buffer, "w", libver="earliest") as h5:
        for group, datasets in groups.items():
            for name, values in datasets.items():
                h5.create_dataset(f"{group}/{name}", data=values, compression="gzip", compression_opts=4, shuffle=True)
        h5[next(iter(groups))].attrs.update(attributes)
    return buffer.getvalue()


def _item(parent: ElementTree.Element, values: NDArray[Any], where: str) -> None:
    """Add a reference to a dataset of an HDF5 file."""
    attributes = {
        "DataType": "Int" if values.dtype.kind == "i" else "Float",
        "Precision": str(values.dtype.itemsize),
        "Dimensions": " ".join(map(str, values.shape)),
        "Format": "HDF",
    }
    ElementTree.SubElement(parent, "DataItem", attributes).text = where


def _attribute(grid: ElementTree.Element, name: str, values: NDArray[Any], where: str, center: str = "Node") -> None:
    kind = "Scalar" if values.ndim == 1 else "Vector"
    _item(ElementTree.SubElement(grid, "Attribute", Name=name, AttributeType=kind, Center=center), values, where)


def _indented(grid: ElementTree.Element, level: int) -> str:
    """Text of a grid at a level of indentation."""
    ElementTree.indent(grid, " ", level)
    return " " * level + ElementTree.tostring(grid, encoding="unicode").rstrip() + "\n"


def _digest(cells: NDArray[np.int64], region: NDArray[np.int64]) -> bytes:
    """A hash of the topology."""
    return sha256(cells.tobytes() + region.tobytes()).digest() + cells.shape[1].to_bytes()

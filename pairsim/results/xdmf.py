"""Fields on a moving mesh, and how they are read from a folder: fields.xdmf describes them, HDF5 files hold the data.

Each time has its own geometry, because the mesh moves, and refers to a topology, which changes at remeshing. Only
features of XDMF are used that ParaView, pyvista (VTK) and meshio all read:

* `fields.xdmf` is a temporal collection. ParaView and pyvista show the deformed particles at every time.
  `meshio.xdmf.TimeSeriesReader` uses the mesh of the first time for all times; for another one set
  `reader.mesh_grid = reader.collection[k]` before `read_points_cells`, or take the points from the field `position`.
* `fields_last.xdmf` has the last time only, for meshio and ParaView: `meshio.read` rejects XDMF files with times, and
  pyvista rejects those without.

Vectors are stored with three components (z, r, 0), symmetric tensors as four scalars `name_zz`, `_zr`, `_rr`, `_tt`.
The data of a frame are in the group `/frames/NUMBER`, those of a mesh in `/mesh/NUMBER`: of a command at work in
`fields/NUMBER.h5`, of one that has ended in `fields.h5` (see `pairsim.results.fields_writer`). Which frames there are,
and where, is what fields.xdmf says.
"""

from __future__ import annotations

import errno
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from pairsim.results.output import FIELDS_XDMF
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    import h5py

TENSOR = ("zz", "zr", "rr", "tt")
TOPOLOGY = {6: "Tri_6", 9: "Quad_9"}
"""XDMF cell types by number of nodes, in the spelling that both VTK and meshio read."""
DAMAGE = (OSError, LookupError, RuntimeError, TypeError, ValueError)
"""What h5py and numpy raise for files that are missing, damaged, or hold something else."""
REFERENCE = re.compile(r"(fields(?:/\d+)?\.h5):(/(?:frames|mesh)/\d+)/\w+")


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
        """Check that every number is known.

        Raises:
            ValueError: A number is not finite.
        """
        for name, values in {"t": np.asarray(self.t), "points": self.points, **self.point_data}.items():
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


@dataclass(frozen=True)
class Place:
    """Where the data of a frame are.

    Attributes:
        t: Time of the frame [D_c/U_av]; for a curve the distance [D_c].
        data: HDF5 file, relative to the folder of the results, and group of the fields.
        mesh: HDF5 file and group of the topology.
    """

    t: float
    data: tuple[str, str]
    mesh: tuple[str, str]


def place_of(grid: ElementTree.Element) -> Place:
    """Where the data of a grid of fields.xdmf are.

    Raises:
        ValueError: It is not a grid as pairsim writes it.
    """
    time, found = grid.find("Time"), []
    for part in ("Geometry", "Topology"):
        if (match := REFERENCE.fullmatch(grid.findtext(f"{part}/DataItem", "").strip())) is None:
            raise ValueError(f"{grid.get('Name')} has no {part} of pairsim")
        found.append((match[1], match[2]))
    if time is None:
        raise ValueError(f"{grid.get('Name')} has no time")
    return Place(float(time.get("Value", "")), *found)


def grids_of(path: Path) -> Iterator[ElementTree.Element]:
    """The descriptions of the frames in fields.xdmf, one at a time, as a long run has many.

    Raises:
        OSError: The file is missing or damaged.
    """
    with path.open("rb") as file:
        try:
            series = None
            for event, element in ElementTree.iterparse(file, ("start", "end")):
                if series is None and event == "start" and element.get("GridType") == "Collection":
                    series = element
                elif series is not None and event == "end" and element.get("GridType") == "Uniform":
                    series.remove(element)
                    yield element
        except ElementTree.ParseError as error:
            raise OSError(errno.EIO, f"damaged ({error})", str(path)) from error


@lru_cache(maxsize=4)
def _places(path: Path, *_signature: int) -> tuple[Place, ...]:
    return tuple(map(place_of, grids_of(path)))


def places(folder: Path | str) -> tuple[Place, ...]:
    """Where the frames of a folder are.

    Raises:
        InputError: There is no readable fields.xdmf.
    """
    path = Path(folder) / FIELDS_XDMF
    try:
        # The file is replaced as a whole, so that these numbers tell whether it is still the same.
        state = path.stat()
        return _places(path, state.st_ino, state.st_mtime_ns, state.st_size)
    except (OSError, ValueError) as error:
        raise InputError(str(path), "", None, f"must be a readable file with fields ({error})") from error


def read_times(folder: Path | str) -> NDArray[np.float64]:
    """Read the times of the frames in a folder.

    Args:
        folder: Folder of the results.

    Returns:
        Times [D_c/U_av] (of a curve: distances [D_c]), shape (frames,); empty without fields.xdmf.

    Raises:
        InputError: fields.xdmf is damaged.
    """
    there = (Path(folder) / FIELDS_XDMF).exists()
    return np.array([place.t for place in places(folder)] if there else [], dtype=float)


def hdf5(path: Any, mode: str, **more: Any) -> h5py.File:
    """An open HDF5 file; h5py is imported for the first one, since most commands have none.

    Args:
        path: The file, or a buffer.
        mode, more: Of `h5py.File`.
    """
    import h5py

    return h5py.File(path, mode, **more)


def open_data(folder: Path, name: str) -> h5py.File:
    """Open an HDF5 file of a folder for reading.

    Without HDF5's locks, which some file systems of clusters do not have.
    """
    return hdf5(folder / name, "r", locking=False)


def read_frame(folder: Path | str, index: int = -1) -> FieldFrame:
    """Read one frame, as it was passed to `FieldsWriter.write`.

    Args:
        folder: Folder of the results.
        index: Index of the frame; negative indices count from the end.

    Raises:
        InputError: There is no such frame, or its files cannot be read.
    """
    frames = places(folder)
    if not -len(frames) <= index < len(frames):
        raise InputError(str(Path(folder) / FIELDS_XDMF), "frame", index, f"must be below {len(frames)}")
    try:
        return _read(Path(folder), frames[index])
    except DAMAGE as error:
        if (now := places(folder)) != frames and index < len(now):  # a run that has ended meanwhile
            return read_frame(folder, index)
        name = frames[index].data[0]
        raise InputError(
            str(Path(folder) / name), "", None, f"must be a readable file with fields ({error})"
        ) from error


def _read(folder: Path, place: Place) -> FieldFrame:
    with open_data(folder, place.data[0]) as h5:
        stored = {key: np.asarray(values[()]) for key, values in h5[place.data[1]].items()}
    with open_data(folder, place.mesh[0]) as h5:
        cells, region = h5[place.mesh[1]]["cells"][()], h5[place.mesh[1]]["region"][()]
    points = stored.pop("position")[:, :2]
    data: dict[str, NDArray[np.float64]] = {}
    for key, values in stored.items():
        stem, _, part = key.rpartition("_")
        if part in TENSOR and all(f"{stem}_{other}" in stored for other in TENSOR):
            data[stem] = np.stack([stored[f"{stem}_{other}"] for other in TENSOR], axis=1)
        else:
            data[key] = values[:, :2] if values.ndim == 2 else values
    return FieldFrame(place.t, int(place.mesh[1].rpartition("/")[2]), points, cells, region, data)

"""Fields on a moving mesh: a file for each frame, and fields.xdmf, the index of these files.

A frame, `fields/NUMBER.h5`, holds the fields at one time together with their mesh, since geometry and topology change
with time. It is written under a temporary name and renamed; fields.xdmf is then replaced in the same way, and so lists
complete frames only, however the process ends. Its paths are relative, so that a folder may be moved.

fields.xdmf is a temporal collection that uses only features of XDMF that ParaView, pyvista (VTK) and meshio all read.
ParaView and pyvista show the deformed particles at every time. `meshio.xdmf.TimeSeriesReader` uses the mesh of the
first time for all times; to read another one, set `reader.mesh_grid = reader.collection[k]` before
`read_points_cells`. `meshio.read` rejects XDMF files with times.

Vectors are stored with three components (z, r, 0), those of disturbances off the axis as (z, r, theta); symmetric
tensors as four scalars `name_zz`, `_zr`, `_rr`, `_tt`.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from pairsim.physics.declared import FIELDS
from pairsim.quantities.kinds import LENGTH, PRESSURE_RATE, PURE, RATE, STRESS, VELOCITY, Kind
from pairsim.record.folder import FIELDS_XDMF, FRAMES, frame_files, write_bytes, write_text
from pairsim.runtime.errors import InputError

TENSOR = ("zz", "zr", "rr", "tt")
ELASTIC = "tau_s"  # 0 in the liquid
DISTURBED_VELOCITY, DISTURBED_PRESSURE = "velocity_disturbance", "pressure_disturbance"
"""Beginnings of the names of disturbances, each followed by "_" and the number of the displaced particle."""
OF_LIQUID = "tau_p", "tr_c", "pressure_extra", DISTURBED_PRESSURE, *FIELDS  # fields named so are 0 in the particles
HEAD = """<?xml version="1.0" encoding="utf-8"?>
<Xdmf Version="3.0">
 <Domain>
  <Grid Name="fields" GridType="Collection" CollectionType="Temporal">
"""
END = """  </Grid>
 </Domain>
</Xdmf>
"""
REFERENCE = re.compile(r"(fields/\d+\.h5):/cells")
"""Matches the reference to the cells of a frame; its group is the file of the frame, relative to the folder."""


def unit_of_field(name: str) -> Kind:
    """The unit of a field by its name in fields.xdmf."""
    others = {"velocity": VELOCITY, "position": LENGTH, "displacement": LENGTH, "tr_c": PURE}
    others |= dict.fromkeys(FIELDS, PURE)
    disturbances = {DISTURBED_VELOCITY: RATE, DISTURBED_PRESSURE: PRESSURE_RATE}
    return others.get(name) or disturbances.get(name.rpartition("_")[0], STRESS)


@dataclass(frozen=True)
class FieldFrame:
    """The fields at one time on the deformed mesh.

    Attributes:
        t: Time [D_c/U_av]; for a curve the distance [D_c], for `focus` the value of the parameter that is followed.
        points: Coordinates z, r of the nodes of the deformed mesh [D_c], shape (n, 2).
        cells: Numbers of the six nodes of each triangle in the order of VTK, shape (m, 6).
        region: 0 in the liquid, i in particle i from upstream, shape (m,).
        point_data: By name scalars (n,), vectors z, r (n, 2) or z, r, theta (n, 3), and symmetric tensors zz, zr, rr,
            tt (n, 4).
    """

    t: float
    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    region: NDArray[np.int64]
    point_data: dict[str, NDArray[np.float64]] = field(default_factory=dict)

    @property
    def stored(self) -> dict[str, NDArray[np.float64]]:
        """Position and fields as they are stored, by name; see the docstring of this module."""
        found = dict[str, NDArray[np.float64]]()
        for name, given in {"position": self.points, **self.point_data}.items():
            values = np.asarray(given, dtype=np.float64)
            if values.ndim == 1:
                found[name] = values
            elif values.shape[1] == 2:
                found[name] = np.pad(values, ((0, 0), (0, 1)))
            elif values.shape[1] == 3:
                found[name] = values
            else:
                found |= {f"{name}_{part}": values[:, i] for i, part in enumerate(TENSOR)}
        return found


class FieldsWriter:
    """Writes frames into a folder as they are computed.

    Args:
        folder: The folder.
        keep: Number of its earlier frames that are kept, the first ones; all others are removed.

    Raises:
        InputError: fields.xdmf is damaged.
        OSError: The files cannot be written.
    """

    def __init__(self, folder: Path | str, keep: int = 0) -> None:
        self.folder = Path(folder)
        grids = _grids(self.folder)
        self._grids = {_time(grid): ElementTree.tostring(grid, encoding="unicode") for grid in grids[:keep]}
        if len(self._grids) < len(grids):
            self._write_index()
        for number, file in frame_files(self.folder):
            if number >= len(self._grids):
                file.unlink()

    @property
    def frames(self) -> int:
        return len(self._grids)

    def write(self, frame: FieldFrame) -> None:
        """Write a frame, and the index in the order of times; nothing is done if there is a frame of that time already.

        Raises:
            ValueError: A number of the frame is not finite.
            OSError: The files cannot be written; the frames before are kept.
        """
        if frame.t in self._grids:
            return
        fields = frame.stored
        for name, values in {"t": np.asarray(frame.t), **fields}.items():
            if not np.isfinite(values).all():
                raise ValueError(f"{name} is not finite at t = {frame.t:g}")
        mesh = {name: np.asarray(getattr(frame, name), dtype=np.int64) for name in ("cells", "region")}
        file = f"{FRAMES}/{self.frames:04d}.h5"
        (self.folder / FRAMES).mkdir(exist_ok=True)
        write_bytes(self.folder / file, _hdf5_content(mesh | fields))
        self._grids[frame.t] = _described(frame.t, file, mesh | fields)
        self._write_index()

    def _write_index(self) -> None:
        if self._grids:
            grids = (f"   {text.strip()}\n" for _, text in sorted(self._grids.items()))
            write_text(self.folder / FIELDS_XDMF, "".join([HEAD, *grids, END]))
        else:
            (self.folder / FIELDS_XDMF).unlink()


def _hdf5_content(arrays: dict[str, NDArray[Any]]) -> bytes:
    """The content of an HDF5 file with these datasets. It is made in memory, since a full disk may crash HDF5."""
    import h5py

    buffer = io.BytesIO()
    with h5py.File(buffer, "w", libver="earliest") as h5:
        for name, values in arrays.items():
            h5.create_dataset(name, data=values, compression="gzip", compression_opts=4, shuffle=True)
    return buffer.getvalue()


def _described(t: float, file: str, arrays: dict[str, NDArray[Any]]) -> str:
    """A frame in XDMF: its time, and references to its arrays in `file`, whose path is relative to the folder."""

    def item(name: str) -> str:
        kind = "Int" if arrays[name].dtype.kind == "i" else "Float"
        shape = " ".join(map(str, arrays[name].shape))
        return f'<DataItem DataType="{kind}" Precision="8" Dimensions="{shape}" Format="HDF">{file}:/{name}</DataItem>'

    def attribute(name: str) -> str:
        kind, center = "Vector" if arrays[name].ndim == 2 else "Scalar", "Cell" if name == "region" else "Node"
        return f'    <Attribute Name="{name}" AttributeType="{kind}" Center="{center}">{item(name)}</Attribute>'

    return "\n".join(
        [
            f'<Grid Name="t = {t:.6g}" GridType="Uniform">',
            f'    <Time Value="{float(t)!r}" />',
            f'    <Topology TopologyType="Tri_6" NumberOfElements="{len(arrays["cells"])}">{item("cells")}</Topology>',
            f'    <Geometry GeometryType="XYZ">{item("position")}</Geometry>',
            *(attribute(name) for name in arrays if name != "cells"),
            "   </Grid>",
        ]
    )


def _grids(folder: Path | str) -> list[ElementTree.Element]:
    """The descriptions of the frames in fields.xdmf, none without the file; InputError if it is damaged."""
    path = Path(folder) / FIELDS_XDMF
    try:
        grids = ElementTree.parse(path).findall("Domain/Grid/Grid")
        _ = [*map(_time, grids)]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, ElementTree.ParseError) as error:
        raise InputError(str(path), "", None, f"must be a readable file with fields ({error})") from error
    return grids


def _time(grid: ElementTree.Element) -> float:
    if (time := grid.find("Time")) is None:
        raise ValueError(f"{grid.get('Name')} has no time")
    return float(time.get("Value", ""))


def read_times(folder: Path | str) -> NDArray[np.float64]:
    """Times [D_c/U_av] (of a curve: distances [D_c]) of the frames in a folder, (frames,); empty without fields.xdmf.

    Raises:
        InputError: fields.xdmf is damaged.
    """
    return np.array([*map(_time, _grids(folder))], dtype=float)


def read_frame(folder: Path | str, index: int = -1) -> FieldFrame:
    """Read a frame of a folder, as it was passed to `FieldsWriter.write`, by its index in the order of times.

    Negative indices count from the end.

    Raises:
        InputError: There is no such frame, or its files cannot be read.
    """
    grids = _grids(folder)
    if not -len(grids) <= index < len(grids):
        raise InputError(str(Path(folder) / FIELDS_XDMF), "frame", index, f"must be below {len(grids)}")
    try:
        return _frame(_time(grids[index]), _arrays(Path(folder), grids[index]))
    except (OSError, LookupError, RuntimeError, TypeError, ValueError) as error:  # of h5py and numpy for other content
        name = f"{Path(folder) / FIELDS_XDMF}, {grids[index].get('Name')}"
        raise InputError(name, "", None, f"must be a readable file with fields ({error})") from error


def _arrays(folder: Path, grid: ElementTree.Element) -> dict[str, NDArray[Any]]:
    """The arrays of a frame by name, from its file.

    It is opened without HDF5's locks, which the file systems of some clusters do not support.
    """
    import h5py

    if (match := REFERENCE.fullmatch(grid.findtext("Topology/DataItem", "").strip())) is None:
        raise ValueError("a frame of an earlier version, or of another program; compute the case again")
    with h5py.File(folder / match[1], "r", locking=False) as file:
        return {name: values[()] for name, values in file.items()}


def _frame(t: float, arrays: dict[str, NDArray[Any]]) -> FieldFrame:
    """The frame that was stored as these arrays."""
    points, cells, region = (arrays.pop(name) for name in ("position", "cells", "region"))
    data: dict[str, NDArray[np.float64]] = {}
    for name, values in arrays.items():
        stem, _, part = name.rpartition("_")
        if part in TENSOR and all(f"{stem}_{other}" in arrays for other in TENSOR):
            data[stem] = np.stack([arrays[f"{stem}_{other}"] for other in TENSOR], axis=1)
        else:
            data[name] = values[:, :2] if values.ndim == 2 and stem != DISTURBED_VELOCITY else values
    return FieldFrame(t, points[:, :2], cells, region, data)

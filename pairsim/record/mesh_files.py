"""Files of meshes with named parts, for meshers and viewers; meshio writes them."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np

from pairsim.runtime.arrays import Array, Indices

FORMATS = {".msh": "gmsh22", ".vtu": "vtu", ".vtk": "vtk", ".xdmf": "xdmf", ".inp": "abaqus"}
"""Formats of meshio that can hold six-node triangles and their three-node sides, by the ending of the file.

Of gmsh's formats, meshio keeps the names of parts only in version 2.2.
"""
ONE_FILE = {"xdmf": {"data_format": "XML"}}
"""Options with which a format needs no second file."""


@dataclass(frozen=True)
class NamedMesh:
    """A mesh of six-node triangles with names for its regions and boundaries.

    Attributes:
        points: Nodes (z, r), shape (n, 2).
        regions: Triangles of each region: vertices, then mid-sides 01, 12, 20, shape (m, 6).
        boundaries: Sides of triangles on each boundary: ends, then middle, shape (m, 3).
    """

    points: Array
    regions: Mapping[str, Indices]
    boundaries: Mapping[str, Indices]

    def scaled(self, factor: float) -> NamedMesh:
        """The mesh with all coordinates multiplied by a factor."""
        return replace(self, points=factor * self.points)

    def content(self, ending: str) -> bytes:
        """The content of a file with one of the endings in `FORMATS`.

        Gmsh's files have the parts as physical groups, Abaqus's as element sets. The others have a cell field, whose
        name is the names of all parts joined by "-", and whose values are the numbers of the parts, from 0.
        """
        import meshio

        parts, name = [*chain(self.regions.items(), self.boundaries.items())], FORMATS[ending]
        numbers = [
            np.repeat(np.arange(first, first + len(of)), [len(each) for each in of.values()])
            for first, of in ((0, self.regions), (len(self.regions), self.boundaries))
        ]
        kinds = ("triangle6", self.regions), ("line3", self.boundaries)
        cells = [(kind, np.vstack([*of.values()])) for kind, of in kinds]
        mesh = meshio.Mesh(np.pad(self.points, ((0, 0), (0, 1))), cells)
        if name == "gmsh22":
            tags = [each + 1 for each in numbers]
            mesh.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
            dimension = dict.fromkeys(self.regions, 2) | dict.fromkeys(self.boundaries, 1)
            mesh.field_data = {part: np.array([tag, dimension[part]]) for tag, (part, _) in enumerate(parts, 1)}
        else:
            mesh.cell_sets = {
                part: [np.flatnonzero(each == number) for each in numbers] for number, (part, _) in enumerate(parts)
            }
            if name != "abaqus":
                mesh.cell_sets_to_data()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"mesh{ending}"
            meshio.write(path, mesh, file_format=name, **ONE_FILE.get(name, {}))
            return path.read_bytes()

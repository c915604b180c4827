"""The mesh with which a run of a case begins, as a file."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np

import pairsim
from pairsim.cases.run_case import Case
from pairsim.computing.problems import mesh_settings
from pairsim.fem.meshes.cell_sizes import make_outlines
from pairsim.fem.meshes.geometry import Geometry, Reference
from pairsim.fem.meshes.meshing import liquid_mesh, particle_meshes


def write_mesh(case: Path, path: Path) -> None:
    """Write the cells of the liquid (region 0) and of the soft particles (1, 2, ... from upstream), six nodes each."""
    checked = pairsim.load(case)
    assert isinstance(checked, Case)
    settings = mesh_settings(checked)
    geometry = Geometry(checked.betas, checked.gaps, checked.tube_length)
    outlines = make_outlines(geometry, settings)
    inside = particle_meshes(geometry, settings, outlines, [Ca_e > 0 for Ca_e in checked.Ca_es])
    parts = [(0, liquid_mesh(Reference.spheres(geometry, outlines), settings), 0.0)]
    parts += [(i, mesh, z) for i, (mesh, z) in enumerate(zip(inside, geometry.centres, strict=True), 1) if mesh]
    points = np.vstack([mesh.points + [z, 0.0] for _, mesh, z in parts])
    starts = np.cumsum([0, *(len(mesh.points) for _, mesh, _ in parts)])
    cells = np.vstack([mesh.cells + start for (_, mesh, _), start in zip(parts, starts, strict=False)])
    region = np.concatenate([np.full(len(mesh.cells), i) for i, mesh, _ in parts])
    found = meshio.Mesh(np.pad(points, ((0, 0), (0, 1))), [("triangle6", cells)], cell_data={"region": [region]})
    path.parent.mkdir(parents=True, exist_ok=True)
    found.write(path)

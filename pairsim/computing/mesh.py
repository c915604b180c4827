"""`pairsim mesh`: write the mesh with which a run of a case begins to a file."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np

from pairsim.cases.run_case import Case
from pairsim.computing.problems import mesh_settings
from pairsim.fem.meshes.cell_sizes import make_outlines
from pairsim.fem.meshes.geometry import Geometry, Reference
from pairsim.fem.meshes.meshing import liquid_mesh, particle_meshes
from pairsim.runtime.errors import WriteFailure

FORMATS = {".msh": {"file_format": "gmsh22"}, ".xdmf": {"data_format": "XML"}}  # XML: one file


def write_mesh(case: Case, path: Path) -> dict[str, int]:
    """Write the mesh with which a run of the case would begin: the liquid and every soft particle.

    Args:
        case: The validated case.
        path: Mesh file; its suffix selects the format (.msh for gmsh, .vtu, .xdmf).

    Returns:
        Numbers of cells and nodes, by name.

    Raises:
        MeshFailure: No valid mesh could be made.
        WriteFailure: The file cannot be written.
    """
    settings = mesh_settings(case)
    geometry = Geometry(case.betas, case.gaps, case.tube_length)
    outlines = make_outlines(geometry, settings)
    liquid = liquid_mesh(Reference.spheres(geometry, outlines), settings)
    inside = particle_meshes(geometry, settings, outlines, [Ca_e > 0 for Ca_e in case.Ca_es])
    soft = [(i, mesh, z) for i, (mesh, z) in enumerate(zip(inside, geometry.centres, strict=True), 1) if mesh]
    points = np.vstack([liquid.points, *(mesh.points + [z, 0.0] for _, mesh, z in soft)])
    starts = np.cumsum([0, len(liquid.points), *(len(mesh.points) for _, mesh, _ in soft)])
    parts = [(0, liquid), *((i, mesh) for i, mesh, _ in soft)]
    cells = np.vstack([mesh.cells + start for (_, mesh), start in zip(parts, starts, strict=False)])
    region = np.concatenate([np.full(len(mesh.cells), i) for i, mesh in parts])
    # Names of physical and geometric groups in gmsh, which shows the regions by them.
    tags = {"gmsh:physical": [region + 1], "gmsh:geometrical": [region + 1]}
    data = tags if path.suffix == ".msh" else {"region": [region]}
    found = meshio.Mesh(np.pad(points, ((0, 0), (0, 1))), [("triangle6", cells)], cell_data=data)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        found.write(path, **FORMATS.get(path.suffix, {}))
    except OSError as error:
        raise WriteFailure(f"{path} cannot be written ({error.strerror or error})", advice="another folder") from error
    liquid_cells = len(liquid.cells)
    return {
        "cells of the liquid": liquid_cells,
        "cells of the particles": len(cells) - liquid_cells,
        "nodes": len(points),
    }

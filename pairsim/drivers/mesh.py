"""`pairsim mesh`: write the reference mesh of a case to a file, optionally with a picture."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import meshio
import numpy as np

from pairsim.config.case import Case
from pairsim.fem.geometry import Geometry, MeshSettings, Reference
from pairsim.fem.meshing import liquid_mesh, make_outlines, particle_meshes
from pairsim.runtime.arrays import Array, Indices


def write_mesh(case: Case, path: Path, png: Path | None) -> dict[str, int]:
    """Write the mesh with which a run of the case would begin: the liquid and every soft particle.

    Args:
        case: The validated case.
        path: Mesh file; its suffix selects the format (.msh for gmsh, .vtu, .xdmf).
        png: File for a picture of the mesh around the particles, or None.

    Returns:
        Numbers of cells, nodes and arcs, by name.

    Raises:
        MeshFailure: No valid mesh could be made.
    """
    settings = MeshSettings(**case.mesh.model_dump())
    geometry = Geometry(case.betas, case.gaps, case.tube_length)
    outlines = make_outlines(geometry, settings)
    liquid = liquid_mesh(Reference.spheres(geometry, outlines), settings)
    points, cells, region = [liquid.points], [liquid.cells], [np.zeros(len(liquid.cells), dtype=np.int64)]
    start = len(liquid.points)
    inside = particle_meshes(geometry, settings, outlines, case.Ca_es)
    for number, (mesh, centre) in enumerate(zip(inside, geometry.centres, strict=True), 1):
        if mesh is None:
            continue
        points.append(mesh.points + [centre, 0.0])
        cells.append(mesh.cells + start)
        region.append(np.full(len(mesh.cells), number))
        start += len(mesh.points)
    every, connect, marker = np.vstack(points), np.vstack(cells), np.concatenate(region)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".part-{path.name}")
    # Names of physical and geometric groups in gmsh, which shows the regions by them.
    tags = {"gmsh:physical": [marker + 1], "gmsh:geometrical": [marker + 1]} if path.suffix == ".msh" else {}
    meshio.Mesh(
        np.column_stack([every, np.zeros(len(every))]), [("triangle6", connect)], cell_data=tags or {"region": [marker]}
    ).write(part, **({"file_format": "gmsh22"} if path.suffix == ".msh" else {}))
    part.replace(path)
    if png is not None:
        _draw(every, connect, marker, geometry, png)
    return {
        "cells of the liquid": len(liquid.cells),
        "cells of the particles": len(connect) - len(liquid.cells),
        "nodes": len(every),
        "arcs of the outlines": sum(len(o.angles) - 1 for o in outlines),
    }


def _draw(points: Array, cells: Indices, region: Indices, geometry: Geometry, png: Path) -> None:
    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.collections import PolyCollection

    reach = sum(geometry.betas) / 2 + sum(geometry.gaps) / 2 + 0.3 if geometry.betas else geometry.length / 2
    figure, axes = pyplot.subplots(figsize=(12, 12 * 0.55 / (2 * reach) + 1))
    outline = points[cells[:, [0, 3, 1, 4, 2, 5]]]
    for marker in np.unique(region):
        face = "white" if marker == 0 else "#f4b6a6"
        axes.add_collection(PolyCollection(outline[region == marker], facecolor=face, edgecolor="0.3", linewidth=0.3))
    axes.set(xlim=(-reach, reach), ylim=(0, 0.5), aspect="equal", xlabel="$z/D_c$", ylabel="$r/D_c$")
    figure.tight_layout()
    png.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(png, dpi=150)
    pyplot.close(figure)

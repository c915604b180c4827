"""`pairsim mesh`: write the reference mesh of a case to a file, optionally with a picture."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import matplotlib
import meshio
import numpy as np

from pairsim.config.case import Case
from pairsim.drivers.problems import mesh_settings
from pairsim.fem.meshes.cell_sizes import make_outlines
from pairsim.fem.meshes.geometry import Geometry, Reference
from pairsim.fem.meshes.meshing import liquid_mesh, particle_meshes
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.errors import WriteFailure

FORMATS = {".msh": {"file_format": "gmsh22"}, ".xdmf": {"data_format": "XML"}}  # XML: one file, which can be renamed


@contextmanager
def _written(path: Path) -> Iterator[Path]:
    """Context that writes a file under the temporary name that it yields.

    Raises:
        WriteFailure: It cannot be written; nothing is left behind.
    """
    part = path.with_name(f".part-{path.name}")  # keeps the suffix, which selects the format
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        part.replace(path)
    except OSError as error:
        message = f"{path} cannot be written ({error.strerror or error})"
        raise WriteFailure(message, advice="another folder, or freeing disk space") from error
    finally:
        with suppress(OSError):  # on a file system that is read-only
            part.unlink(missing_ok=True)


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
        WriteFailure: A file cannot be written.
    """
    settings = mesh_settings(case)
    geometry = Geometry(case.betas, case.gaps, case.tube_length)
    outlines = make_outlines(geometry, settings)
    liquid = liquid_mesh(Reference.spheres(geometry, outlines), settings)
    points, cells, region = [liquid.points], [liquid.cells], [np.zeros(len(liquid.cells), dtype=np.int64)]
    start = len(liquid.points)
    inside = particle_meshes(geometry, settings, outlines, [Ca_e > 0 for Ca_e in case.Ca_es])
    for number, (mesh, centre) in enumerate(zip(inside, geometry.centres, strict=True), 1):
        if mesh is None:
            continue
        points.append(mesh.points + [centre, 0.0])
        cells.append(mesh.cells + start)
        region.append(np.full(len(mesh.cells), number))
        start += len(mesh.points)
    every, connect, marker = np.vstack(points), np.vstack(cells), np.concatenate(region)
    # Names of physical and geometric groups in gmsh, which shows the regions by them.
    tags = {"gmsh:physical": [marker + 1], "gmsh:geometrical": [marker + 1]} if path.suffix == ".msh" else {}
    mesh = meshio.Mesh(
        np.column_stack([every, np.zeros(len(every))]), [("triangle6", connect)], cell_data=tags or {"region": [marker]}
    )
    with _written(path) as part:
        mesh.write(part, **FORMATS.get(path.suffix, {}))
    if png is not None:
        with _written(png) as part:
            _draw(every, connect, marker, geometry, part)
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
    try:
        figure.savefig(png, dpi=150)
    finally:
        pyplot.close(figure)

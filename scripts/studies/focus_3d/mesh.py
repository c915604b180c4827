"""Six-node-sided tetrahedra of half a tube with a spherical bead: an octant, mirrored, and then displaced.

The undisplaced mesh mirrors itself at x = 0 and z = 0, so that errors by cells do not move the bead sideways there, and
are the same for opposite displacements. The bead is displaced by a smooth map that leaves wall and ends.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import basix.ufl
import gmsh
import numpy as np
from dolfinx import mesh as dolfinx_mesh
from dolfinx.io.gmsh import cell_perm_array
from mpi4py import MPI

type Array = np.ndarray[Any, Any]
TETRAHEDRON_OF_TEN_NODES = 11  # of gmsh
RADIUS = 0.5  # of the tube [D_c]
ROUNDING = 1e-9


class Sizes(NamedTuple):
    """Lengths of the mesh [D_c]."""

    bead: float
    """Radius of the bead."""
    half_length: float
    near: float
    """Size of the cells at the bead."""
    growth: float
    """By which they are larger per distance from it."""
    far: float
    """Size at most."""


def octant(sizes: Sizes) -> tuple[Array, Array]:
    """Nodes (n, 3) and cells (m, 10) where x, y and z are positive."""
    gmsh.initialize(["", "-v", "1"])
    try:
        cad = gmsh.model.occ
        tube = cad.addCylinder(0, 0, 0, 0, 0, sizes.half_length, RADIUS, angle=np.pi / 2)
        cad.cut([(3, tube)], [(3, cad.addSphere(0, 0, 0, sizes.bead))])
        cad.synchronize()
        for option in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
            gmsh.option.setNumber(f"Mesh.MeshSize{option}", 0)
        gmsh.model.mesh.setSizeCallback(
            lambda dim, tag, x, y, z, size: min(
                sizes.near + sizes.growth * (np.sqrt(x * x + y * y + z * z) - sizes.bead), sizes.far
            )
        )
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.optimize("Netgen")
        gmsh.model.mesh.setOrder(2)
        gmsh.model.mesh.optimize("HighOrder")
        tags, points, _ = gmsh.model.mesh.getNodes()
        _, nodes = gmsh.model.mesh.getElementsByType(TETRAHEDRON_OF_TEN_NODES)
    finally:
        gmsh.finalize()
    place = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    place[tags] = np.arange(len(tags))
    cells = place[nodes.astype(np.int64)].reshape(-1, 10)
    used, cells = np.unique(cells, return_inverse=True)
    points = points.reshape(-1, 3)[used]
    points[np.abs(points) < ROUNDING] = 0.0
    return points, cells.reshape(-1, 10)


def mirrored(points: Array, cells: Array, axis: int) -> tuple[Array, Array]:
    """A mesh together with its mirror image, whose common nodes are those with the coordinate 0."""
    own = np.flatnonzero(points[:, axis] != 0)
    image = points[own].copy()
    image[:, axis] *= -1
    number = np.arange(len(points))
    number[own] = len(points) + np.arange(len(own))
    return np.concatenate([points, image]), np.concatenate([cells, number[cells]])


def half_tube(sizes: Sizes) -> dolfinx_mesh.Mesh:
    """The mesh where y is positive, with the bead on the axis."""
    points, cells = octant(sizes)
    for axis in (0, 2):
        points, cells = mirrored(points, cells, axis)
    cells = cells[:, cell_perm_array(dolfinx_mesh.CellType.tetrahedron, 10)]
    element = basix.ufl.element("Lagrange", "tetrahedron", 2, shape=(3,))
    return dolfinx_mesh.create_mesh(MPI.COMM_SELF, cells, element, points)


def displacement(points: Array, bead: float) -> Array:
    """By how much nodes move with a unit displacement of the bead: 1 at it, 0 at the wall, smooth to the third order.

    Args:
        points: Nodes with the bead on the axis, shape (n, 3).
        bead: Radius of the bead.
    """
    s = np.clip((np.linalg.norm(points, axis=1) - bead) / (RADIUS - bead), 0, 1)
    return 1 - s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)

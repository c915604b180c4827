"""The inertial term in the momentum balance of an axisymmetric solution, to first order in the Reynolds number."""

from __future__ import annotations

from functools import cache
from math import pi

import numpy as np
import ufl

from pairsim.fem.azimuthal.fields import Numbering
from pairsim.fem.meshes.six_node_mesh import TO_BASIX, SixNodeMesh
from pairsim.fem.phases.compiled_form import CompiledForm, compiled
from pairsim.fem.phases.compiled_phase import COORDINATE, QUADRATURE_DEGREE, mixed_element, split
from pairsim.fem.scene import Scene
from pairsim.physics.fields import MESH_VELOCITY, VELOCITY
from pairsim.runtime.arrays import Array
from pairsim.runtime.fenicsx import MPI, dolfinx

_FIELDS = (VELOCITY, MESH_VELOCITY)


@cache
def _compiled() -> tuple[CompiledForm, ufl.Coefficient]:
    """The form int ((u - w) . grad u) . v 2 pi r dx, and the coefficient of u and w."""
    mesh = ufl.Mesh(COORDINATE)
    space = ufl.FunctionSpace(mesh, mixed_element(_FIELDS))
    x = ufl.Coefficient(space)
    fields, test = split(x, _FIELDS), split(ufl.TestFunction(space), _FIELDS)
    acceleration = ufl.dot(ufl.grad(fields["u"]), fields["u"] - fields["w"])
    r = ufl.SpatialCoordinate(mesh)[1]
    dx = ufl.Measure("dx", domain=mesh, metadata={"quadrature_degree": QUADRATURE_DEGREE})
    return compiled(ufl.inner(acceleration, test["u"]) * 2 * pi * r * dx), x


def inertia(scene: Scene, x: Array, w: Array) -> Array:
    """The inertial term of the residual at held distances and Re = 1, shape (n,).

    The particles themselves are not accelerated.

    Args:
        scene: The scene.
        x: Full vector of the axisymmetric solution, shape (n,).
        w: Velocity of the mesh at the vertices, shape (v, 2).
    """
    form, symbol = _compiled()
    mesh = SixNodeMesh(scene.positions(x), scene.liquid.six_node_mesh.cells)
    put = dolfinx.mesh.create_mesh(MPI.COMM_SELF, mesh.cells[:, TO_BASIX], COORDINATE, mesh.points)
    numbering = Numbering(put, mesh, _FIELDS)
    function = dolfinx.fem.Function(numbering.space)
    u = scene.liquid.nodal("u", x)
    function.x.array[:] = np.concatenate([u.ravel(), w.ravel()])[numbering.canonical]
    vector = np.zeros(numbering.size)
    dolfinx.fem.assemble_vector(vector, form.on([numbering.space], {symbol: function}, {}))
    tested = np.zeros(numbering.size)
    tested[numbering.canonical] = vector
    load = np.zeros(scene.size)
    scene.liquid.nodal("u", load)[:] = numbering.nodal("u", tested)
    return load

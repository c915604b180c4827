"""Motion of displaced particles: lateral velocity, rotation, and how a soft one rolls inside its shape."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from pairsim.fem.azimuthal.nodal import derivative_along
from pairsim.fem.body import Body
from pairsim.fem.meshes.geometry import Outline
from pairsim.runtime.arrays import Array

ON_AXIS = 1e-12  # radius [D_c]


def translation(count: int) -> Array:
    """The unit vector e_x at points, components (z, r, theta) times cos, cos and sin theta; shape (count, 3)."""
    return np.tile([0.0, 1.0, -1.0], (count, 1))


def rotation(points: Array) -> Array:
    """The velocity e_y x X of a unit rotation at points (z, r) of the half-plane, shape (n, 2) -> (n, 3)."""
    z, r = points.T
    return np.column_stack([-r, z, -z])


def rolling(outline: Outline, deformed: Array) -> Array:
    """The velocity F (e_y x X) of the nodes of an outline when the material of the sphere X has a unit rotation.

    The deformed particle keeps its shape while its material moves through it. In the half-plane e_y x X is the
    derivative of X with respect to the polar angle; the same derivative of the deformed position x is that of a spline.

    Args:
        outline: Outline of the sphere.
        deformed: Its nodes in the deformed particle, relative to any point on the axis, shape (2 k + 1, 2).

    Returns:
        Components in (z, r, theta), shape (2 k + 1, 3).
    """
    angles, sphere = outline.node_angles, outline.nodes
    both = np.concatenate([angles, 2 * np.pi - angles[-2::-1]])
    closed = np.concatenate([deformed, deformed[-2::-1] * [1.0, -1.0]])
    closed[-1] = closed[0]
    along = CubicSpline(both, closed, bc_type="periodic")(angles, 1)
    found = np.column_stack([along, -along[:, 1]])
    off_axis = slice(1, -1)
    hoop = deformed[off_axis, 1] / sphere[off_axis, 1]
    found[off_axis, 2] = -hoop * sphere[off_axis, 0]
    found[[0, -1], 0] = 0.0
    return found


def turning(body: Body, h: Array) -> Array:
    """The velocity of the surface of a particle at a unit rotation of its material, at the nodes of its outline.

    Args:
        body: The particle.
        h: Positions of the material, shape (n_h,).

    Returns:
        Shape (2 k + 1, 3).
    """
    if body.phase is None:
        return rotation(body.outline.nodes)
    return rolling(body.outline, body.outline_points(h))


def rolling_inside(body: Body, h: Array) -> Array:
    """The velocity F (e_y x X) of `rolling` at all nodes of a soft particle, shape (nodes, 3).

    Derivatives at nodes are means over the cells around them.
    """
    assert body.phase is not None
    mesh, deformed = body.phase.six_node_mesh, body.positions(h)
    sphere = mesh.points
    # e_y x X in the half-plane is the derivative of X with respect to the polar angle.
    along = derivative_along(mesh, deformed, sphere[:, ::-1] * [-1.0, 1.0])
    found = np.column_stack([along, -along[:, 1]])
    off_axis = sphere[:, 1] > ON_AXIS
    found[off_axis, 2] = -(deformed[off_axis, 1] / sphere[off_axis, 1]) * sphere[off_axis, 0]
    found[~off_axis, 0] = 0.0
    return found

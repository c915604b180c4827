"""Quantities evaluated from a solution: gaps, velocities, shapes, volumes, and indicators of its quality.

Definitions are in "What is reported", docs/explanation/physics.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pairsim.fem.algebra.constraints import Constraints
from pairsim.fem.body import Body
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh, jacobians
from pairsim.fem.scene import Scene
from pairsim.physics.conformation import exponential
from pairsim.runtime.arrays import Array, Indices


@dataclass(frozen=True)
class Observation:
    """The state of the particles at one time.

    Attributes:
        d: Distances between facing surfaces on the axis [D_c], shape (N-1,).
        U: Velocities of the particles, averaged over their volumes [U_av], shape (N,).
        D: Taylor parameters, shape (N,).
        dp: Pressure drop over the length of the tube [eta_0 U_av/D_c].
        dp_without_particles: Pressure drop of the same tube without particles [eta_0 U_av/D_c].
        F: Forces on the particles that move them at a prescribed velocity [eta_0 U_av D_c], shape (N,), or (0,).
        m: Lagrange multiplier of the zero mean pressure, a uniform source in the continuity equation.
        volume_error: Largest relative change of the volume of a particle.
        conformation: Indicators of the conformation field, None for a liquid without polymer modes.
    """

    d: Array
    U: Array
    D: Array
    dp: float
    dp_without_particles: float
    F: Array
    m: float
    volume_error: float
    conformation: Health | None

    @property
    def dU(self) -> Array:
        """Velocity of each particle relative to its upstream neighbour, shape (N-1,)."""
        return np.diff(self.U)

    @property
    def dp_plus(self) -> float:
        """Pressure drop in excess of that of the tube without particles."""
        return self.dp - self.dp_without_particles

    @property
    def s_jump(self) -> float:
        """Largest change of a component of s = log c within a cell; 0 in a liquid without polymer modes."""
        return 0.0 if self.conformation is None else self.conformation.s_jump


def extents(outline: Array) -> tuple[float, float, float]:
    """Extreme positions of a piecewise quadratic outline, including extrema between nodes.

    Args:
        outline: Nodes (z, r), ends and mid-points of the arcs alternating, shape (2 k + 1, 2).

    Returns:
        Smallest z, largest z and largest r.
    """

    def range_of(values: Array) -> tuple[float, float]:
        left, middle, right = values[:-2:2], values[1::2], values[2::2]
        # v(s) = middle + b s + c s^2 on [-1, 1]
        b, c = (right - left) / 2, (left + right) / 2 - middle
        with np.errstate(divide="ignore", invalid="ignore"):
            s = np.where(c != 0, -b / (2 * c), 2.0)
        inside = np.abs(s) < 1
        turning = (middle + b * s + c * s**2)[inside]
        every = np.concatenate([values, turning])
        return float(every.min()), float(every.max())

    z_min, z_max = range_of(outline[:, 0])
    return z_min, z_max, range_of(outline[:, 1])[1]


def taylor_parameter(outline: Array) -> float:
    """Taylor parameter D = (L_z - L_r)/(L_z + L_r) of a piecewise quadratic outline, shape (2 k + 1, 2)."""
    z_min, z_max, r_max = extents(outline)
    length, width = z_max - z_min, 2 * r_max
    return (length - width) / (length + width)


# Local coordinates on an arc of the corners of the polygon by which a contour is measured: with 28 arcs the polygon
# adds 1e-7 to a deformation.
POINTS = np.linspace(-1, 1, 65)


class Contour(NamedTuple):
    """What a microscope sees of a particle: its section, the convex hull of this, and its volume; lengths in D_c."""

    area: float
    deformation: float  # 1 - 2 sqrt(pi area)/perimeter
    area_hull: float
    deformation_hull: float
    inertia_ratio_hull: float  # root of the second moment of area along the axis over that across
    volume: float


def contour(outline: Array) -> Contour:
    """Measure an outline: nodes (z, r), ends and mid-points of the arcs alternating, shape (2 k + 1, 2)."""
    whole = polygon(outline)
    area, deformation, _ = measure(whole)
    z, r = whole[: len(whole) // 2].T
    volume = np.pi / 3 * abs(np.diff(z) @ (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2))
    return Contour(area, deformation, *measure(whole[hull(whole)]), float(volume))


def polygon(outline: Array, points: Array = POINTS) -> Array:
    """The polygon, symmetric about the axis, of an outline and its mirror image, shape (m, 2).

    Args:
        outline: The outline, as in `contour`.
        points: Local coordinates, from -1 to 1, of the corners on each arc.
    """
    left, middle, right = outline[:-2:2], outline[1::2], outline[2::2]
    s = points[:-1, None, None]
    fine = np.concatenate([(middle + s * (right - left) / 2 + s**2 * ((left + right) / 2 - middle)), right[None]])
    half = fine.transpose(1, 0, 2).reshape(-1, 2)
    return np.concatenate([half, half[::-1] * [1.0, -1.0]])


def hull(polygon: Array) -> Indices:
    """The points of a polygon, shape (m, 2), that are vertices of its convex hull, in order."""
    from scipy.spatial import ConvexHull  # imported here as runs do not need it

    return np.asarray(ConvexHull(polygon).vertices)


def measure(polygon: Array) -> tuple[float, float, float]:
    """Area, deformation and inertia ratio, by Green's theorem, of a polygon about the axis, shape (m, 2)."""
    (z, r), (z_next, r_next) = polygon.T, np.roll(polygon, -1, axis=0).T
    cross = z * r_next - z_next * r
    area, perimeter = cross.sum() / 2, np.hypot(z_next - z, r_next - r).sum()
    centre = cross @ (z + z_next) / (6 * area)
    along = cross @ (z**2 + z * z_next + z_next**2) / 12 - area * centre**2
    across = cross @ (r**2 + r * r_next + r_next**2) / 12
    return float(abs(area)), float(1 - 2 * np.sqrt(np.pi * abs(area)) / perimeter), float(np.sqrt(along / across))


def gaps(bodies: list[Body], h: Array) -> Array:
    """Distances between facing surfaces on the axis, shape (N-1,).

    Args:
        bodies: Particles, ordered from upstream.
        h: Positions of the material, shape (n_h,).
    """
    outlines = [body.outline_points(h) for body in bodies]
    return np.array([b[-1, 0] - a[0, 0] for a, b in pairwise(outlines)])


def centres(bodies: list[Body], h: Array) -> Array:
    """Axial positions of the centres of volume [D_c], shape (N,); the rates of their differences are dU."""
    places = []
    for body in bodies:
        if body.phase is None:
            places.append(float(h[body.start]))
            continue
        points = body.positions(h)
        places.append(body.quadrature.mean(points[:, 0], points))
    return np.array(places)


def velocities(bodies: list[Body], velocity: Array, h: Array) -> Array:
    """Velocities of the particles, averaged over their volumes [U_av], shape (N,).

    Args:
        bodies: The particles.
        velocity: Velocity of their material, shape (n_h,).
        h: Its positions, shape (n_h,).
    """
    return np.array([body.mean(velocity, h) for body in bodies])


def observe(
    scene: Scene, constraints: Constraints, y: Array, h: Array, x: Array, dp_without_particles: float
) -> Observation:
    """Evaluate the observation of a solution.

    Args:
        scene: The scene.
        constraints: Its constraints.
        y: Free unknowns, shape (n_y,).
        h: Positions of the material, shape (n_h,).
        x: Full vector, shape (n,).
        dp_without_particles: Pressure drop of the same tube without particles.
    """
    D, change = [], 0.0
    for body in scene.bodies:
        if body.phase is None:
            D.append(0.0)
            continue
        D.append(taylor_parameter(body.outline_points(h)))
        reference = body.quadrature.volume(body.phase.six_node_mesh.points)
        change = max(change, abs(body.quadrature.volume(body.positions(h)) / reference - 1))
    conformation = None
    if scene.material.modes:
        liquid = scene.liquid
        conformation = health(scene.log_conformations(x), scene.positions(x), liquid.six_node_mesh)
    return Observation(
        d=gaps(scene.bodies, h),
        U=velocities(scene.bodies, constraints.V @ y, h),
        D=np.array(D),
        dp=scene.scalar_terms.pressure_drop(x),
        dp_without_particles=dp_without_particles,
        F=x[scene.F],
        m=float(x[scene.m]),
        volume_error=change,
        conformation=conformation,
    )


def liquid_distortion(scene: Scene, x: Array) -> float:
    """Smallest ratio of the current Jacobian of a liquid cell to its reference one; not above 0 if one is inverted."""
    if not scene.moving:
        return 1.0
    mesh = scene.liquid.six_node_mesh
    return float((jacobians(scene.positions(x)[mesh.cells]) / mesh.jacobians).min())


def solid_distortion(bodies: list[Body], h: Array) -> float:
    """Smallest ratio of the current Jacobian of a solid cell to its reference one.

    In an incompressible solid this ratio is the inverse of the hoop stretch. It is infinite without soft particles.
    """
    least = np.inf
    for body in bodies:
        if body.phase is not None:
            mesh = body.phase.six_node_mesh
            least = min(least, float((jacobians(body.positions(h)[mesh.cells]) / mesh.jacobians).min()))
    return least


@dataclass(frozen=True)
class Health:
    """Indicators of the quality of a conformation field.

    Attributes:
        c_max: Largest trace of c of any mode.
        c_max_z: Axial position of the largest trace.
        c_max_r: Radial position of the largest trace.
        c_min: Smallest eigenvalue of c.
        s_jump: Largest variation of a component of s = log c within one cell. A value of order one or more indicates
            that the mesh does not resolve the conformation.
    """

    c_max: float
    c_max_z: float
    c_max_r: float
    c_min: float
    s_jump: float


def health(s: Array, positions: Array, mesh: SixNodeMesh) -> Health:
    """Evaluate the indicators of a conformation field.

    Args:
        s: Log-conformation of M modes at all nodes, components (zz, zr, rr, tt) each, shape (n, 4 M).
        positions: Positions of the nodes, shape (n, 2).
        mesh: Mesh of the liquid.
    """
    trace, smallest = np.zeros(len(s)), np.full(len(s), np.inf)
    for each in np.split(s, s.shape[1] // 4, axis=1):
        c = exponential(each)
        trace = np.maximum(trace, c[:, 0] + c[:, 2] + c[:, 3])
        x = np.hypot((each[:, 0] - each[:, 2]) / 2, each[:, 1])
        smallest = np.minimum(smallest, np.minimum((each[:, 0] + each[:, 2]) / 2 - x, each[:, 3]))
    top = int(np.argmax(trace))
    by_cell = s[mesh.cells]
    return Health(
        float(trace[top]),
        float(positions[top, 0]),
        float(positions[top, 1]),
        float(np.exp(smallest.min())),
        float(np.ptp(by_cell, axis=1).max()),
    )

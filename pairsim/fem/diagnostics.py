"""What is read off a solution: gaps, velocities, shapes, volumes, health."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pairsim.fem.constraints import Constraints
from pairsim.fem.scene import Body, Scene
from pairsim.fem.six_node_mesh import SixNodeMesh, jacobians
from pairsim.physics.conformation import exponential
from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class Observation:
    """The state of the particles at one time.

    Attributes:
        d: Distances between facing surfaces on the axis, (N-1,).
        U: Velocities of the centres of volume, (N,).
        D: Taylor parameters, (N,).
        dp: Pressure drop over the tube.
        dp_without_particles: That of the same tube without particles.
        m: Uniform source of the pressure gauge.
        volume_error: Largest relative change of a particle's volume.
        conformation: What to watch in a viscoelastic liquid, None in a Newtonian one.
    """

    d: Array
    U: Array
    D: Array
    dp: float
    dp_without_particles: float
    m: float
    volume_error: float
    conformation: Health | None

    @property
    def dU(self) -> Array:
        """Velocity of each particle relative to the one upstream of it, (N-1,)."""
        return np.diff(self.U)

    @property
    def dp_plus(self) -> float:
        """Pressure drop that the particles cause."""
        return self.dp - self.dp_without_particles


def extents(outline: Array) -> tuple[float, float, float]:
    """Extreme positions of a quadratic outline, also between its nodes.

    Args:
        outline: Nodes, arc ends and mid-sides alternating, (2 k + 1, 2).

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
    """D = (L_z - L_r)/(L_z + L_r) on the curved outline."""
    z_min, z_max, r_max = extents(outline)
    length, width = z_max - z_min, 2 * r_max
    return (length - width) / (length + width)


def gaps(bodies: list[Body], h: Array) -> Array:
    """Distances between facing surfaces on the axis, (N-1,)."""
    outlines = [body.outline_points(h) for body in bodies]
    return np.array([b[-1, 0] - a[0, 0] for a, b in pairwise(outlines)])


def observe(
    scene: Scene, constraints: Constraints, y: Array, h: Array, x: Array, dp_without_particles: float
) -> Observation:
    """Read the observation off a solution, given the pressure drop of the same tube without particles."""
    velocity = constraints.V @ y
    U, D, change = [], [], 0.0
    for body in scene.bodies:
        if body.phase is None:
            U.append(float(velocity[body.start]))
            D.append(0.0)
            continue
        points = body.phase.six_node_mesh.points + body.displacement(h)
        U.append(body.quadrature.mean(body.displacement(velocity)[:, 0], points))
        D.append(taylor_parameter(body.outline_points(h)))
        reference = body.quadrature.volume(body.phase.six_node_mesh.points)
        change = max(change, abs(body.quadrature.volume(points) / reference - 1))
    conformation = None
    if scene.polymer is not None:
        liquid = scene.liquid
        conformation = health(liquid.nodal("s", x), scene.positions(x), liquid.six_node_mesh)
    return Observation(
        d=gaps(scene.bodies, h),
        U=np.array(U),
        D=np.array(D),
        dp=scene.pressure_drop(x),
        dp_without_particles=dp_without_particles,
        m=float(x[scene.m]),
        volume_error=change,
        conformation=conformation,
    )


def liquid_distortion(scene: Scene, x: Array) -> float:
    """Smallest ratio of a liquid cell's current to its reference Jacobian; not above zero if a cell is turned over."""
    if not scene.moving:
        return 1.0
    mesh = scene.liquid.six_node_mesh
    nodes = np.arange(len(mesh.points))
    eta = np.column_stack([x[scene.liquid.index("eta", nodes, c)] for c in range(2)])
    now = jacobians((mesh.points + eta)[mesh.cells])
    return float((now / mesh.jacobians).min())


def solid_distortion(bodies: list[Body], h: Array) -> float:
    """Smallest ratio of a solid cell's current to its reference Jacobian (1/hoop stretch where incompressible)."""
    least = np.inf
    for body in bodies:
        if body.phase is not None:
            mesh = body.phase.six_node_mesh
            now = jacobians((mesh.points + body.displacement(h))[mesh.cells])
            least = min(least, float((now / mesh.jacobians).min()))
    return least


@dataclass(frozen=True)
class Health:
    """What to watch in a conformation field.

    Attributes:
        c_max, c_max_z, c_max_r: Largest trace of c, and where it is.
        c_min: Smallest eigenvalue of c.
        s_jump: Largest change of s across one cell: of order one means a mesh too coarse for it.
    """

    c_max: float
    c_max_z: float
    c_max_r: float
    c_min: float
    s_jump: float


def health(s: Array, positions: Array, mesh: SixNodeMesh) -> Health:
    """Look at s at all nodes, (n, 4), that are at `positions`."""
    c = exponential(s)
    trace = c[:, 0] + c[:, 2] + c[:, 3]
    top = int(np.argmax(trace))
    x = np.hypot((s[:, 0] - s[:, 2]) / 2, s[:, 1])
    smallest = np.minimum((s[:, 0] + s[:, 2]) / 2 - x, s[:, 3])
    by_cell = s[mesh.cells]
    return Health(
        float(trace[top]),
        float(positions[top, 0]),
        float(positions[top, 1]),
        float(np.exp(smallest.min())),
        float(np.ptp(by_cell, axis=1).max()),
    )

"""The outline of a single weakly soft sphere, from a run in time until it is steady."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from scipy.interpolate import CubicSpline

from pairsim.fem.body import Body
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.solids import soft
from pairsim.runtime.arrays import Array
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.transient import Transient

BETA = 0.4


def modes(body: Body, h: Array, Ca: float) -> Array:
    """Legendre coefficients f_n of the outline about its centre of volume, (r/a - 1)/Ca = sum f_n P_n(cos theta)."""
    nodes = body.outline_points(h)
    s = np.linspace(-1, 1, 9)
    shapes = np.stack([s * (s - 1) / 2, 1 - s**2, s * (s + 1) / 2], axis=1)
    curve = np.vstack([shapes @ nodes[k : k + 3] for k in range(0, len(nodes) - 2, 2)])
    assert body.phase is not None
    points = body.phase.six_node_mesh.points + body.displacement(h)
    curve = curve - [body.quadrature.mean(points[:, 0], points), 0.0]
    angle, radius = np.arctan2(curve[:, 1], curve[:, 0]), np.hypot(*curve.T)
    angle, first = np.unique(angle, return_index=True)
    x, w = legendre.leggauss(400)
    f = CubicSpline(angle, radius[first] / body.outline.radius - 1)(np.arccos(x)) / Ca
    return np.array([(2 * n + 1) / 2 * np.sum(w * f * legendre.Legendre.basis(n)(x)) for n in range(8)])


def modes_of_sphere(
    Ca: float, mesh: MeshSettings | None = None, length: float = 50 * BETA, periodic: bool = True
) -> Array:
    """The modes of a sphere of diameter 0.4 at a small Ca_e, 30 Ca_e after its start."""
    problem = Problem(
        betas=(BETA,),
        solids=soft(Ca),
        gaps=(),
        length=length,
        periodic=periodic,
        mesh=mesh or MeshSettings(),
        control=StepControl(3e-4, 1e-9, 3 * Ca),
        first_step=Ca / 100,
        U_m=2 * (1 - 2 / 3 * BETA**2),
    )
    transient = Transient(problem)
    h = [step.h for step in transient.steps(iter([30 * Ca]))][-1]
    found = modes(transient.bodies[0], h, Ca)
    transient.close()
    return found

"""Momentum balance of the interpolated polymer stress after a remeshing of the liquid.

The weak divergence of the stress changes when it is interpolated to another mesh. Without correction the solvent stress
would have to compensate for the difference. As the solvent viscosity is small, all velocities would jump, and would
recover within a time of order xi De, while the strain of the liquid restores the balance. Here this strain is imposed
at once: the imbalance drives a velocity w, and s changes as in a liquid that is deformed by w during a time
STRAIN_TIME De, much shorter than the relaxation time. This is repeated as long as w becomes smaller, at most PASSES
times. The velocities of the solution remain those interpolated from the old mesh.
"""

from __future__ import annotations

import numpy as np

from pairsim.fem.algebra.constraints import PositionUpdate
from pairsim.fem.algebra.scene_constraints import balance_constraints
from pairsim.fem.scene import Scene
from pairsim.physics.fields import PRESSURE
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.solvers.mesh_transfer import free_unknowns
from pairsim.solvers.nonlinear.newton import Newton

# Duration of the deformation by w in relaxation times: short enough for relaxation to be small, long enough for the
# elastic response to exceed the viscous one. Three times as long was measured to be worse than no balance at De 2.
STRAIN_TIME = 0.1
# Smooth parts of the imbalance vanish after one or two iterations. Others remove velocities that vary from cell to
# cell; continuous stresses balance them slowly, and they affect the velocities of the particles. Measured jumps of dU
# in % of its peak after 2, 4, 8 and 16 iterations: 0.81, 0.26, 0.20, 0.19 (De 0.5, soft particles) and 2.4, 0.98, 0.24,
# 0.12 (De 0.5, rigid particles, accuracy 5%).
PASSES = 16


def balanced(scene: Scene, x: Array, h: Array, velocity: Array, U_m: float, clock: Clock) -> Array:
    """Correct s and p (and m and dp) of a full vector such that momentum is balanced at its velocities.

    Args:
        scene: A time-dependent scene with a viscoelastic liquid.
        x: Full vector with u, p, s and the displacement of the mesh, shape (n,).
        h: Positions of the material, shape (n_h,).
        velocity: Velocities of the material, shape (n_h,).
        U_m: Velocity of the frame.
        clock: Stopwatch for the phases of the computation.

    Returns:
        The corrected full vector; `x` itself if the matrix is singular.
    """
    liquid = scene.liquid
    constraints = balance_constraints(scene, x)
    newton = Newton(scene, constraints, clock=clock)
    y = free_unknowns(scene, constraints, x)
    moved = constraints.V.tocoo()
    y[moved.col] = velocity[moved.row]
    # The mesh moves with the liquid during the deformation, so that there is no convection relative to it.
    time, star = STRAIN_TIME * scene.material.longest, constraints.expand(y, h)
    if scene.moving:
        liquid.nodal("eta", star)[:] -= time * (liquid.nodal("u", star) - [U_m, 0.0])
    momentum = np.concatenate([constraints.fields[name] for name in ("u", "v", "U_p") if name in constraints.fields])
    balancing = [*(field.unknowns for field in scene.material.transported), PRESSURE.unknowns, "m", "dp"]
    try:
        update = PositionUpdate(h)
        scene.set_step(star, time, U_m, solids=False)
        if not newton.factor_at(y, update):
            return x
        last, before = np.inf, y
        for _ in range(PASSES):
            imbalance = np.zeros(constraints.size)
            imbalance[momentum] = newton.residual_at(y, update)[momentum]
            change = -newton.linear_solve(imbalance)
            w = float(np.linalg.norm(change[momentum]))
            if not w < last:  # the last iteration increased w, or w is not a number
                y = before
                break
            before = y.copy()
            for name in balancing:
                if name in constraints.fields:
                    y[constraints.fields[name]] += change[constraints.fields[name]]
            last = w
    finally:
        newton.destroy()
    return constraints.expand(y, h)

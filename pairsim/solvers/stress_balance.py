"""Stress that was carried to a new mesh of the liquid, put back into balance with the flow that was carried along.

On another mesh an interpolated stress has another weak divergence. The solvent alone would have to make up for the
difference, and as its viscosity is small all velocities would jump, until within some xi De the liquid has been
strained by as much as the stress is off. That strain is imposed here at once: s changes as in a material that is
strained fast,

    ds = STRAIN_TIME De grad w  (all that the constitutive law does with a velocity gradient),

by the velocity w that the imbalance drives, until w is small; the velocities are those that were carried over.
"""

from __future__ import annotations

import numpy as np

from pairsim.fem.scene import Scene
from pairsim.fem.scene_constraints import balance_constraints
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.solvers.mesh_transfer import free_unknowns
from pairsim.solvers.newton import Newton

# Time that w acts for, in relaxation times: short enough that hardly anything relaxes, long enough that the elastic
# response exceeds the viscous one.
STRAIN_TIME = 0.1
# Smooth parts of the imbalance are gone after one or two passes. The rest is what the last passes are for: velocities
# that vary from cell to cell, which continuous stresses hardly balance, and which still move the particles. Jumps of dU
# in % of the peak after 2, 4, 8 and 16 passes: .81, .26, .20, .19 (De .5, soft), 2.4, .98, .24, .12 (De .5, rigid, 5%).
PASSES = 16


def balanced(scene: Scene, x: Array, h: Array, velocity: Array, U_m: float, clock: Clock) -> Array:
    """Change s and p of a full vector so that momentum is balanced at its velocities.

    Args:
        scene: A viscoelastic scene in time.
        x: Full vector with u, p, s and the mesh's displacement.
        h: Positions of the material, (n_h,).
        velocity: Velocities of the material, (n_h,).
        U_m: Velocity of the frame.
        clock: Where the seconds go.

    Returns:
        The full vector, on every process the same; `x` itself where the matrix is singular.
    """
    liquid, polymer = scene.liquid, scene.polymer
    assert polymer is not None
    constraints = balance_constraints(scene, x)
    newton = Newton(scene, constraints, clock=clock)
    y = free_unknowns(constraints, x)
    moved = constraints.V.tocoo()
    y[moved.col] = velocity[moved.row]
    # The mesh follows the liquid for the time of the strain, so that nothing is convected through it.
    time, star = STRAIN_TIME * polymer.De, constraints.expand(y, h)
    if scene.moving:
        u, nodes = liquid.nodal("u", star) - [U_m, 0.0], np.arange(len(liquid.six_node_mesh.points))
        for c in range(2):
            star[liquid.index("eta", nodes, c)] -= time * u[:, c]
    momentum = np.concatenate([constraints.fields[name] for name in ("u", "v", "U_p") if name in constraints.fields])
    try:
        newton.place(h)
        scene.set_step(star, time, U_m)
        if not newton.factor_at(y):
            return x
        last, before = np.inf, y
        for _ in range(PASSES):
            imbalance = np.zeros(constraints.size)
            imbalance[momentum] = newton.residual_at(y)[momentum]
            change = -newton.linear_solve(imbalance)
            w: float = scene.comm.bcast(float(np.linalg.norm(change[momentum])))
            if not w < last:  # the last pass has made it worse, or what it led to is no number
                y = before
                break
            before = y.copy()
            for name in ("s", "p_f", "m", "dp"):
                if name in constraints.fields:
                    y[constraints.fields[name]] += change[constraints.fields[name]]
            last = w
    finally:
        newton.destroy()
    return scene.comm.bcast(constraints.expand(y, h))

"""Fields of a scene whose particles are displaced, for fields.xdmf."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pairsim.fem.azimuthal import motion
from pairsim.record.fields_of_frame import steady_frame
from pairsim.record.xdmf import DISTURBED_PRESSURE, DISTURBED_VELOCITY, FieldFrame
from pairsim.runtime.arrays import Array
from pairsim.solvers.focus.stability import Stability
from pairsim.solvers.steady.scene import SteadySolver


def disturbed_frame(at: float, solver: SteadySolver, stability: Stability) -> FieldFrame:
    """The fields with all particles on the axis, and what a unit displacement of each adds to them at fixed points.

    Args:
        at: The value of the followed key.
        solver: The scene, at its solution.
        stability: The disturbances by displaced particles.
    """
    frame, data = steady_frame(at, solver), dict[str, Array]()
    for j in range(len(stability.disturbance.rates)):
        velocity, pressure = np.zeros((len(frame.points), 3)), np.zeros(len(frame.points))
        x = stability.disturbance.fields[:, j]
        of_liquid = len(stability.scene.phases[0].mesh.points)
        velocity[:of_liquid], pressure[:of_liquid] = stability.scene.velocity(x), stability.scene.pressure(x)
        velocity[of_liquid:] = np.concatenate([np.zeros((0, 3)), *_inside(solver, stability, j)])
        data |= {f"{DISTURBED_VELOCITY}_{j + 1}": velocity, f"{DISTURBED_PRESSURE}_{j + 1}": pressure}
    return replace(frame, point_data=frame.point_data | data)


def _inside(solver: SteadySolver, stability: Stability, j: int) -> list[Array]:
    """Velocities [U_av/D_c] that a displacement of particle j adds in each soft particle, shape (nodes, 3) each.

    The material of a particle is translated, and rolls inside its shape.
    """
    (h, _), found = solver.state(), stability.disturbance
    velocities = []
    for i, body in enumerate(solver.scene.bodies):
        if body.phase is not None:
            rolling = motion.rolling_inside(body, h)
            velocities.append(found.rates[i, j] * motion.translation(len(rolling)) + found.rotation[i, j] * rolling)
    return velocities

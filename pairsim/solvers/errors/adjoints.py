"""Adjoint solutions of the results of a quasi-steady scene.

The derivative of a result J(y) along any change dR of the residual is -z . dR, with the adjoint z of J. The adjoints of
all results are solved for at once; what moving adds, sensitivities, slopes and errors are products with them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.fem.diagnostics import hull, measure, polygon, taylor_parameter
from pairsim.runtime.arrays import Array
from pairsim.solvers.steady.linearisation import DIFFERENCE, Linearisation
from pairsim.solvers.steady.pressure_drop import InnerDrop
from pairsim.solvers.steady.scene import SteadySolver

MEASURES = ("D", "deformation_hull")
"""What is measured of the shape of a single soft particle, by the names of columns."""


@dataclass(frozen=True)
class Adjoints:
    """Adjoints at a solution.

    Attributes:
        all: Those of velocities, forces, `MEASURES` of a single soft particle, and pressure drop, in this order,
            (N + forces + measures + 1, n_y).
        forces: Number of the forces.
        velocities: Of the velocities of the particles, (N, n_y).
        drop: The pressure drop.
    """

    all: Array
    forces: int
    velocities: Array
    drop: InnerDrop

    @staticmethod
    def of(at: Linearisation) -> Adjoints:
        """Solve for them at a solution."""
        steady = at.steady
        fields, drop = steady.constraints.fields, InnerDrop.of(steady)
        own = np.concatenate([fields["U_p"], fields.get("F", np.empty(0, np.int64))])
        read = np.zeros((len(own), steady.constraints.size))
        read[np.arange(len(own)), own] = 1.0
        rows = np.vstack([read, _of_shape(steady), drop.row])
        solutions = at.adjoint(rows)
        count = len(fields["U_p"])
        return Adjoints(solutions, len(own) - count, solutions[:count], drop)


def _of_shape(steady: SteadySolver) -> Array:
    """Derivatives of the measures of a single soft particle's shape by the free unknowns, (measures or 0, n_y)."""
    body, *others = steady.bodies
    if others or body.phase is None:
        return np.zeros((0, steady.constraints.size))
    outline = body.outline_points(steady.state()[0])
    convex = hull(polygon(outline))
    step = DIFFERENCE * body.outline.radius
    by_position = np.zeros((len(MEASURES), steady.scene.h_size))
    for (node, component), value in np.ndenumerate(outline):
        ends = []
        for change in (step, -step):
            outline[node, component] = value + change
            ends.append((taylor_parameter(outline), measure(polygon(outline)[convex])[1]))
        outline[node, component] = value
        at = body.start + 2 * body.nodes[node] + component
        by_position[:, at] = np.subtract(ends[0], ends[1]) / (2 * step)
    return np.asarray((steady.constraints.M.T @ by_position.T).T)

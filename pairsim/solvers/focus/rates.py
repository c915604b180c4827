"""Rates at which particles move towards the axis or away from it, per displacement from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.fem.azimuthal.scene import DisturbedScene
from pairsim.runtime.arrays import Array
from pairsim.solvers.nonlinear.direct import DirectSolver
from pairsim.solvers.steady.scene import SteadySolver

# Iterations for what depends on rates of change. Each gains a factor of about the rate times the relaxation time.
MOST_ITERATIONS = 30  # chosen
TOLERANCE = 1e-8  # of the rates, relative to the largest; chosen


@dataclass(frozen=True)
class Disturbance:
    """What unit displacements of the N particles from the axis do, to first order.

    Attributes:
        rates: a_ij, velocity of particle i away from the axis per displacement of particle j [U_av/D_c], shape (N, N),
            after stresses and shapes have forgotten all but the displacements, with which they change.
        at_rest: The same for stresses and shapes as they were if the displacements did not change, shape (N, N).
        rotation: Rate of rotation of particle i about theta = 90 degrees per displacement of particle j [U_av/D_c^2],
            shape (N, N); of soft particles, of their material inside the shape.
        fields: Full vectors of the disturbances, shape (n, N).
        converged: Whether stresses and shapes forget faster than the displacements change; otherwise `rates` are those
            at rest, and `pairsim.solvers.focus.modes` tells what happens.
    """

    rates: Array
    at_rest: Array
    rotation: Array
    fields: Array
    converged: bool

    @property
    def growth(self) -> Array:
        """Growth rates of the displacements of all particles together, complex, shape (N,), the largest first."""
        found = np.linalg.eigvals(self.rates)
        return np.asarray(found[np.argsort(-found.real)])


def disturb(steady: SteadySolver) -> Disturbance:
    """Displace the particles of a scene from the axis.

    Args:
        steady: The scene, at a solution, in a tube with two ends.

    Raises:
        NoSteadyState: The matrix is singular.
    """
    return disturbance_at(steady, steady.y)


def disturbance_at(steady: SteadySolver, y: Array, Re: float = 0.0) -> Disturbance:
    """The same for free unknowns y of the scene, shape (n_y,), with inertia at a Reynolds number.

    Raises:
        NoSteadyState: The matrix is singular.
    """
    h, x = steady.state_at(steady.parameters, y)
    U = y[steady.constraints.fields["U_p"]]
    scene = DisturbedScene(steady.scene, h, x, U, Re=Re, volume_modulus=steady.problem.volume_modulus)
    solver = DirectSolver(scene.matrix)
    try:
        return _solved(scene, solver)
    finally:
        solver.close()


def _solved(scene: DisturbedScene, solver: DirectSolver) -> Disturbance:
    """Solve for disturbances that do not change at first, and then with their rates of change.

    This is an iteration of subspaces: it converges to the N modes that decay most slowly, if these are motions of the
    particles.
    """
    lateral, load = scene.constraints.lateral, scene.load()
    y = at_rest_y = solver.solve(load)
    at_rest = rates = y[lateral]
    changes = scene.memory is not None or len(scene.phases) > 1
    converged = not changes
    for _ in range(MOST_ITERATIONS if changes else 0):
        y = solver.solve(load + scene.load_of_rates(y, rates))
        before, rates = rates, y[lateral]
        if not np.isfinite(rates).all():
            break
        converged = bool(np.abs(rates - before).max() <= TOLERANCE * np.abs(rates).max())
        if converged:
            break
    if not converged:
        y, rates = at_rest_y, at_rest
    return Disturbance(rates, at_rest, y[scene.constraints.rotation], scene.expand(y), converged)

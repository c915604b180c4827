"""Rates at which particles move towards the axis or away from it, per displacement from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pairsim.fem.azimuthal.scene import DisturbedScene
from pairsim.runtime.arrays import Array
from pairsim.solvers.focus.factors import CORRECTION, DisturbedFactors
from pairsim.solvers.nonlinear.factors import EXACT
from pairsim.solvers.steady.scene import SteadySolver

# Iterations for what depends on rates of change. Each gains a factor of about the rate times the relaxation time.
MOST_ITERATIONS = 30  # chosen
TOLERANCE = 1e-8  # of the rates, relative to the largest; chosen
# Rates that have become larger than the first ones by this factor grow with their square from then on; chosen.
DIVERGED = 1e6


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


def scene_at(steady: SteadySolver, y: Array, Re: float = 0.0, like: DisturbedScene | None = None) -> DisturbedScene:
    """The disturbed scene about free unknowns y of a scene, shape (n_y,), with inertia at a Reynolds number.

    What does not depend on these is taken from `like`, the scene about other ones on the same mesh.
    """
    h, x = steady.state_at(steady.parameters, y)
    U = y[steady.constraints.fields["U_p"]]
    return DisturbedScene(steady.scene, h, x, U, Re=Re, volume_modulus=steady.problem.volume_modulus, like=like)


class Displacement:
    """Unit displacements of the particles of a scene from the axis, and the factors with which they were solved for.

    Args:
        steady: The scene, at a solution, in a tube with two ends.
        tolerance: Of the iteration for what depends on rates of change, relative to the largest rate.

    Attributes:
        steady: The same, at the solution that one step with Newton's matrix makes exact.
        scene: The disturbed scene.
        found: What the displacements do.
        y: The free unknowns of the disturbances, shape (n_y, N).

    Raises:
        NoSteadyState: The matrix is singular.
    """

    def __init__(self, steady: SteadySolver, tolerance: float = TOLERANCE) -> None:
        self.steady, self._tolerance = steady, tolerance
        steady.linearise()
        self.scene = scene_at(steady, steady.y)
        self._factors = DisturbedFactors(self.scene)
        try:
            self.found, self.y = self._solved()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Displacement:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the memory of the factors."""
        self._factors.close()

    def _solved(self) -> tuple[Disturbance, Array]:
        """Solve for disturbances that do not change at first, and then with their rates of change.

        This is an iteration of subspaces: it converges to the N modes that decay most slowly, if these are motions of
        the particles.
        """
        scene, load = self.scene, self.scene.load()
        at_rest = self._factors.solve(load)
        y, converged = self._iterated(at_rest, lambda y, rates: load + scene.load_of_rates(y, rates))
        if not converged:
            y = at_rest
        lateral, rotation = scene.constraints.lateral, scene.constraints.rotation
        found = Disturbance(y[lateral], at_rest[lateral], y[rotation], scene.expand(y), converged)
        return found, y

    def changed_by(self, slope: Array) -> Array:
        """Derivatives of the disturbances by a parameter, shape (n_y, N).

        Args:
            slope: Derivative by it of the residual at these disturbances, shape (n_y, N).

        Raises:
            ArithmeticError: The iteration for what depends on rates of change does not converge.
        """
        scene, a = self.scene, self.found.rates

        def load(change: Array, rates: Array) -> Array:
            return scene.load_of_rates(self.y, rates) - scene.of_change(scene.constraints.N @ (change @ a)) - slope

        start = self._factors.solve(-slope, CORRECTION if self._follows else EXACT)
        change, converged = self._iterated(start, load)
        if not converged:
            raise ArithmeticError("stresses and shapes do not follow the displacements")
        return change

    @property
    def _follows(self) -> bool:
        """Whether something depends on rates of change."""
        return self.scene.memory is not None or len(self.scene.phases) > 1

    def _iterated(self, start: Array, load: Callable[[Array, Array], Array]) -> tuple[Array, bool]:
        """Iterate y = K^-1 load(y, lateral velocities in y) where something depends on rates of change.

        Each iteration solves for a correction only, with factors whose error the next one corrects.

        Returns:
            The last y, and whether its lateral velocities have converged.
        """
        lateral, y = self.scene.constraints.lateral, start
        if not self._follows:
            return y, True
        most = DIVERGED * np.abs(y[lateral]).max()
        for _ in range(MOST_ITERATIONS):
            before = y[lateral]
            y = self._factors.corrected(y, load(y, before))
            largest = np.abs(y[lateral]).max()
            if not largest <= most:  # nor a number
                return y, False
            if np.abs(y[lateral] - before).max() <= self._tolerance * largest:
                return y, True
        return y, False


def disturb(steady: SteadySolver) -> Disturbance:
    """Displace the particles of a scene from the axis.

    Args:
        steady: The scene, at a solution, in a tube with two ends.

    Raises:
        NoSteadyState: The matrix is singular.
    """
    with Displacement(steady) as displacement:
        return displacement.found

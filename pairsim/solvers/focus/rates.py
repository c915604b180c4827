"""Rates at which displaced particles move towards the axis or away from it: velocity per displacement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pairsim.fem.azimuthal.scene import DisturbedScene
from pairsim.runtime.arrays import Array
from pairsim.solvers.focus.factors import CORRECTION, DisturbedFactors
from pairsim.solvers.nonlinear.factors import EXACT
from pairsim.solvers.steady.scene import SteadySolver

# Iterations for the terms with rates of change. Each reduces the error by a factor of about rate times relaxation time.
MOST_ITERATIONS = 30  # chosen
TOLERANCE = 1e-8  # of the rates, relative to the largest one; chosen
# Growth of the rates, relative to the first ones, at which the iteration has diverged; chosen.
DIVERGED = 1e6


@dataclass(frozen=True)
class Disturbance:
    """The response to unit displacements of the N particles from the axis, to first order.

    Attributes:
        rates: a_ij, velocity of particle i away from the axis per displacement of particle j [U_av/D_c], shape (N, N),
            when stresses and shapes have lost all memory but that of the displacements, and change along with these.
        at_rest: The same with the stresses and shapes that belong to constant displacements [U_av/D_c], shape (N, N).
        rotation: Rate of rotation of particle i about the axis theta = 90 degrees per displacement of particle j
            [U_av/D_c^2], shape (N, N); for soft particles, that of their material within the shape.
        fields: Full vectors of the disturbances, shape (n, N).
        converged: Whether stresses and shapes relax faster than the displacements change. Otherwise `rates` are those
            at rest, and the modes of `pairsim.solvers.focus.modes` have to be computed.
    """

    rates: Array
    at_rest: Array
    rotation: Array
    fields: Array
    converged: bool

    @property
    def growth(self) -> Array:
        """Growth rates of joint displacements of all particles [U_av/D_c], complex, shape (N,), the largest first."""
        found = np.linalg.eigvals(self.rates)
        return np.asarray(found[np.argsort(-found.real)])


def scene_at(steady: SteadySolver, y: Array, Re: float = 0.0, like: DisturbedScene | None = None) -> DisturbedScene:
    """The equations of disturbances about an axisymmetric state.

    Args:
        steady: The axisymmetric scene.
        y: Free unknowns of the state, shape (n_y,).
        Re: Reynolds number.
        like: The disturbed scene about another state on the same mesh, whose data are reused where they do not depend
            on the state; None to compute all.
    """
    h, x = steady.state_at(steady.parameters, y)
    U = y[steady.constraints.fields["U_p"]]
    return DisturbedScene(steady.scene, h, x, U, Re=Re, volume_modulus=steady.problem.volume_modulus, like=like)


class Displacement:
    """Unit displacements of the particles of a scene from the axis, with the factors of the matrix of disturbances.

    Args:
        steady: The scene, at a solution, in a tube with two ends.
        tolerance: Tolerance of the iteration for the terms with rates of change, relative to the largest rate.

    Attributes:
        steady: The scene, whose solution has been improved by one step with the exact matrix.
        scene: The disturbed scene.
        found: The response to the displacements.
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
        """Solve for constant disturbances, and then by iteration for those that change at the resulting rates.

        This is a subspace iteration: it converges to the N modes that decay most slowly, if these are motions of the
        particles.
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
        """Derivatives of the disturbances with respect to a parameter, shape (n_y, N).

        Args:
            slope: Derivative of the residual at fixed disturbances with respect to the parameter, shape (n_y, N).

        Raises:
            ArithmeticError: The iteration for the terms with rates of change does not converge.
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
        """Whether any term depends on rates of change."""
        return self.scene.memory is not None or len(self.scene.phases) > 1

    def _iterated(self, start: Array, load: Callable[[Array, Array], Array]) -> tuple[Array, bool]:
        """Iterate y = K^-1 load(y, lateral velocities in y), if any term depends on rates of change.

        Each iteration solves for a correction only, roughly, as the next one corrects its error.

        Args:
            start: First guess, shape (n_y, N), which is returned if no term depends on rates.
            load: Right-hand sides, shape (n_y, N), as a function of y and of the lateral velocities, shape (N, N).

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
            if not largest <= most:  # also if it is not a number
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

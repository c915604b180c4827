"""The residual of a quasi-steady scene that moves: with the terms that holding the distances drops.

Holding the distances drops the velocity with which the particles' surfaces deform, the viscous stress inside them, the
velocity of the mesh relative to the particles, and the rates of what the liquid carries along. Given the rates of
distances and unknowns, they are put back.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pairsim.fem.phases.phase import Phase
from pairsim.runtime.arrays import Array
from pairsim.solvers.parameters import DIFFERENCE, Parameters
from pairsim.solvers.steady.linearisation import Linearisation
from pairsim.solvers.steady.scene import SteadySolver


def moving_residual(
    steady: SteadySolver,
    parameters: Parameters,
    y: Array,
    y_t: Array,
    rates: Array,
) -> Array:
    """The complete residual of a scene at given rates, shape (n_y,).

    Args:
        steady: The scene.
        parameters: Its parameters.
        y: Free unknowns, shape (n_y,).
        y_t: Their rates, seen by observers who move with the particles, shape (n_y,).
        rates: Rates of the distances [U_av], shape (N-1,).
    """
    scene, constraints = steady.scene, steady.constraints
    h_t = material_rates(steady, parameters, y_t, rates)
    with steady.changed_to(parameters) as update:
        h, x = constraints.state(y, update)
        liquid, U, means = scene.liquid, y[constraints.fields["U_p"]], []
        for body, at in zip(steady.bodies, scene.nodes.interfaces, strict=True):
            means.append(body.mean(h_t, h))
            if body.phase is not None:
                liquid.nodal("u", x)[at] += body.displacement(h_t)[body.nodes] - [means[-1], 0.0]
        scene.set_solid_rates(scene.with_displacements(x, h - h_t), 1.0)
        if scene.material.has_memory:
            x_t = constraints.N @ y_t + constraints.C @ h_t
            # The mesh goes with the particles by what is left of U without the motion of their surfaces: all of it
            # where distances are held, the common velocity where they change at the rates that belong to U.
            still = y.copy()
            still[constraints.fields["U_p"]] = U - means
            frame, vertices = liquid.nodal("w", constraints.N @ still), liquid.six_node_mesh.vertices
            liquid.nodal("w", x)[:] = frame * [1.0, 0.0] + liquid.nodal("eta", x_t)[vertices]
            star = x[: liquid.size].copy()
            for field in scene.material.transported:
                liquid.nodal(field.name, star)[:] -= liquid.nodal(field.name, x_t)
            liquid.set_star(star)
            liquid.constants["rate"].value = 1.0
        return steady.newton.reduce(x)


def rate_terms(at: Linearisation, y_t: Array, rates: Array) -> Array:
    """What rates add to the residual of a solution, shape (n_y,); arguments as of `moving_residual`."""
    return moving_residual(at.steady, at.parameters, at.y, y_t, rates) - at.residual


class ShapeRates:
    """What rates of the particles' shapes add to the residual of a solution at held distances.

    What the liquid carries along follows the surfaces at once. Then rates count in the velocity of the liquid on the
    surfaces and in the stress of viscous solids alone, and the other phases are not assembled.

    Args:
        at: The solution, at which its solver is left.

    Attributes:
        moving: Which free unknowns move soft particles; boolean, shape (n_y,). The inside of elastic particles too: it
            has no stress of its own, but a part of the velocity of their centres.
        means: Velocities of the centres of the particles (rows) by the rates of the free unknowns, (N, n_y).
        viscous: Whether any solid is viscous.
    """

    def __init__(self, at: Linearisation) -> None:
        steady = at.steady
        self._at, scene, M = at, steady.scene, steady.constraints.M
        self.moving: np.ndarray = np.asarray(abs(M).T @ np.ones(scene.h_size) > 0)
        self._h, self._x = steady.state()
        weights = np.array([body.mean_weights(self._h) for body in steady.bodies]).reshape(-1, scene.h_size)
        self.means: Array = (M.T @ weights.T).T
        viscous = [b.phase for b in steady.bodies if b.phase is not None and b.phase.material.viscosity is not None]
        self.viscous = bool(viscous)
        self._phases: list[Phase] = [scene.liquid, *viscous]
        self._still = self._residual(self._x)

    def terms(self, y_t: Array, *, solids: bool = True) -> Array:
        """What rates of the unknowns add, shape (n_y,).

        Args:
            y_t: The rates, seen by observers who move with the particles, shape (n_y,).
            solids: Whether viscous solids have their stress.
        """
        steady, x = self._at.steady, self._x.copy()
        scene, h_t, means = steady.scene, steady.constraints.M @ y_t, self.means @ y_t
        u = scene.liquid.nodal("u", x)
        for body, at, mean in zip(steady.bodies, scene.nodes.interfaces, means, strict=True):
            if body.phase is not None:
                u[at] += body.displacement(h_t)[body.nodes] - [mean, 0.0]
        if not (solids and self.viscous):
            return self._residual(x) - self._still
        with steady.changed_to(self._at.parameters):
            scene.set_solid_rates(scene.with_displacements(x, self._h - h_t), 1.0)
            return self._residual(x) - self._still

    def _residual(self, x: Array) -> Array:
        """The part of the residual that is due to the phases in which rates count, shape (n_y,)."""
        scene = self._at.steady.scene
        local = np.zeros(scene.size)
        for phase in self._phases:
            start = scene.offset(phase)
            phase.set(x[start : start + phase.size])
            local[start : start + phase.size] = phase.residual()
        return np.asarray(self._at.steady.constraints.T @ local)


def material_rates(steady: SteadySolver, parameters: Parameters, y_t: Array, rates: Array) -> Array:
    """Rates of the material positions h at given rates of unknowns and distances, shape (n_h,); see above."""
    fastest, deformed = float(np.abs(rates).max(initial=0.0)), steady.constraints.M @ y_t
    if fastest == 0.0:
        return np.asarray(deformed)
    step = DIFFERENCE * rates / fastest
    ends = [steady.h_star(replace(parameters, gaps=tuple(np.add(parameters.gaps, s * step)))) for s in (1, -1)]
    # Those of undeformed particles are linear in the distances.
    return np.asarray(fastest * (ends[0] - ends[1]) / (2 * DIFFERENCE) + deformed)

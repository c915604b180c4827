"""The unsteady residual of a quasi-steady scene, with the terms that are dropped where the distances are held.

These terms are the velocity at which the surfaces of the particles deform, the viscous stress inside them, the velocity
of the mesh relative to the particles, and the rates of transported fields of the liquid. They follow from the rates of
the distances and of the unknowns.
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
    """The unsteady residual R(y; y_t, d_t) of a scene, shape (n_y,).

    Args:
        steady: The scene.
        parameters: Its parameters.
        y: Free unknowns, shape (n_y,).
        y_t: Their rates of change in frames that move with the particles, shape (n_y,).
        rates: Rates of the distances, d_t [U_av], shape (N-1,).
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
            # `means` is the part of the particles' velocities that the rates account for; the mesh follows the rest as
            # at held distances. The rest is all of U where distances are held, and the common velocity where they
            # change at the rates that belong to U.
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
    """Contribution of rates to the residual of a solution, shape (n_y,); arguments as for `moving_residual`."""
    return moving_residual(at.steady, at.parameters, at.y, y_t, rates) - at.residual


class ShapeRates:
    """Contribution of the rates of the particles' shapes to the residual of a solution at held distances.

    Transported fields of the liquid are taken to follow the surfaces instantaneously. Rates then enter only the
    velocity of the liquid on the surfaces and the stress of viscous solids, and no other phases are assembled.

    Args:
        at: The solution, at which its solver is left.

    Attributes:
        moving: Which free unknowns move the material of soft particles; boolean, shape (n_y,). These include the inside
            of elastic particles, which causes no stress but contributes to the velocity of their centres.
        means: Derivatives of the velocities of the particles' centres (rows) with respect to the rates of the free
            unknowns (columns), (N, n_y).
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
        """Contribution of rates of the unknowns to the residual, shape (n_y,).

        Args:
            y_t: The rates in frames that move with the particles, shape (n_y,).
            solids: Whether the stress of viscous solids is included.
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
        """The part of the residual that is due to the phases in which rates matter, shape (n_y,)."""
        scene = self._at.steady.scene
        local = np.zeros(scene.size)
        for phase in self._phases:
            start = scene.offset(phase)
            phase.set(x[start : start + phase.size])
            local[start : start + phase.size] = phase.residual()
        return np.asarray(self._at.steady.constraints.T @ local)


def material_rates(steady: SteadySolver, parameters: Parameters, y_t: Array, rates: Array) -> Array:
    """Rates of the material positions h, shape (n_h,), at given rates of unknowns and distances.

    The arguments are those of `moving_residual`.
    """
    fastest, deformed = float(np.abs(rates).max(initial=0.0)), steady.constraints.M @ y_t
    if fastest == 0.0:
        return np.asarray(deformed)
    step = DIFFERENCE * rates / fastest
    ends = [steady.h_star(replace(parameters, gaps=tuple(np.add(parameters.gaps, s * step)))) for s in (1, -1)]
    # The positions h* of undeformed particles are linear in the distances.
    return np.asarray(fastest * (ends[0] - ends[1]) / (2 * DIFFERENCE) + deformed)

"""The residual of a quasi-steady scene that moves: with the terms that holding the distances drops.

Holding the distances drops the velocity with which the particles' surfaces deform, the viscous stress inside them, the
velocity of the mesh relative to the particles, and the rates of what the liquid carries along. Given the rates of
distances and unknowns, they are put back.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

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
    *,
    stress: bool = True,
    solids: bool = True,
) -> Array:
    """The complete residual of a scene at given rates, shape (n_y,).

    Args:
        steady: The scene.
        parameters: Its parameters.
        y: Free unknowns, shape (n_y,).
        y_t: Their rates, seen by observers who move with the particles, shape (n_y,).
        rates: Rates of the distances [U_av], shape (N-1,).
        stress: Whether what the liquid carries along has a rate, too; otherwise it follows the surfaces at once.
        solids: Whether viscous solids have their stress.
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
        if solids:
            scene.set_solid_rates(scene.with_displacements(x, h - h_t), 1.0)
        if scene.material.has_memory and stress:
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


def rate_terms(at: Linearisation, y_t: Array, rates: Array, *, stress: bool = True, solids: bool = True) -> Array:
    """What rates add to the residual of a solution, shape (n_y,); arguments as of `moving_residual`."""
    moving = moving_residual(at.steady, at.parameters, at.y, y_t, rates, stress=stress, solids=solids)
    return moving - at.residual


def material_rates(steady: SteadySolver, parameters: Parameters, y_t: Array, rates: Array) -> Array:
    """Rates of the material positions h at given rates of unknowns and distances, shape (n_h,); see above."""
    fastest, deformed = float(np.abs(rates).max(initial=0.0)), steady.constraints.M @ y_t
    if fastest == 0.0:
        return np.asarray(deformed)
    step = DIFFERENCE * rates / fastest
    ends = [steady.h_star(replace(parameters, gaps=tuple(np.add(parameters.gaps, s * step)))) for s in (1, -1)]
    # Those of undeformed particles are linear in the distances.
    return np.asarray(fastest * (ends[0] - ends[1]) / (2 * DIFFERENCE) + deformed)

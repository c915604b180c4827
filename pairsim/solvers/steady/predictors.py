"""First guesses of a quasi-steady solution."""

from __future__ import annotations

import numpy as np

from pairsim.solvers.mesh_transfer import carry_particles, free_unknowns
from pairsim.solvers.steady.scene import SteadySolver


def place_undeformed(steady: SteadySolver, *, at_rest: bool = False) -> None:
    """Take undeformed spheres as first guess, in the developed flow or in a liquid at rest.

    In a liquid at rest the shape derivatives of flow and pressure vanish. The first iteration then yields Stokes flow
    past spheres, and their deformation to first order in Ca_e; from the developed flow, which crosses the particles,
    Newton's method does not converge if they are soft. In the developed flow the particles have the velocity on the
    axis, less the Faxen correction 2/3 beta^2 of a sphere in Poiseuille flow, unless their velocity is prescribed.

    Args:
        steady: The scene.
        at_rest: Whether the liquid is at rest; only in liquids without a memory.
    """
    liquid, constraints, fixed = steady.scene.liquid, steady.constraints, steady.problem.drive.velocity
    x, velocity = steady.meshed.displaced(steady.h_star(steady.parameters)), 0.0
    if not at_rest:
        points = liquid.six_node_mesh.points
        if steady.scene.material.newtonian:
            liquid.nodal("u", x)[:] = steady.scene.boundary_velocity(points)
        else:
            steady.scene.prescribe(x, np.arange(len(points)), steady.developed_flow)
        on_axis = steady.scene.boundary_velocity(np.zeros((1, 2)))[0, 0]
        velocity = on_axis * (1 - 2 / 3 * max(steady.problem.betas, default=0.0) ** 2)
    steady.y = free_unknowns(steady.scene, constraints, x)
    steady.y[constraints.fields["U_p"]] = velocity if fixed is None else fixed


def adopt(steady: SteadySolver, other: SteadySolver) -> None:
    """Take the interpolated solution of the same scene on another mesh as first guess.

    Args:
        steady: The scene, which gets the parameters of the other one.
        other: The other scene, at a solution.
    """
    h, x = other.state()
    displaced = h - other.h_star(other.parameters)
    there, p_s = carry_particles(other.scene, x, displaced, steady.bodies)
    y, entry = np.zeros(steady.constraints.size), steady.constraints.M.tocoo()
    y[entry.col] = there[entry.row]
    y[steady.constraints.fields["U_p"]] = other.y[other.constraints.fields["U_p"]]
    if "p_s" in steady.constraints.fields:
        y[steady.constraints.fields["p_s"]] = p_s
    h = steady.h_star(other.parameters) + steady.constraints.M @ y
    steady.parameters = other.parameters
    steady.flows.learn(other.flows)
    steady.y = steady.carried_over(other.scene, x, h, y[steady.meshed.material])

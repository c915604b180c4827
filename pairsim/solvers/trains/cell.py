"""A train of equal particles in a tube: a periodic cell with one of them, and one with several.

A cell of several particles repeats the mesh of a cell of one. The pressure differs by dp between its ends, and the mesh
does not move on the planes between particles. All particles are then equal to rounding error, and the response of the
particles to the displacement of one of them is a circulant matrix.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pairsim.physics.fields import DISPLACEMENT, VELOCITY
from pairsim.quantities.kinds import LENGTH
from pairsim.runtime.errors import NoSteadyState
from pairsim.runtime.message import Message
from pairsim.solvers.mesh_transfer import free_unknowns
from pairsim.solvers.meshed_scene import Cells
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.steady.scene import SteadySolver

# Chosen.
SAME_DISTANCE = 1e-7  # largest relative difference between the distance and the one wanted
MOST_SPACINGS = 12  # number of spacings that are tried to reach it


def distance(one: SteadySolver) -> float:
    """Distance between facing surfaces of neighbours in a train [D_c], from its cell of one particle."""
    outline = one.bodies[0].outline_points(one.state()[0])
    return float(one.problem.length - (outline[0, 0] - outline[-1, 0]))


def one_particle(problem: SteadyProblem, parameters: Parameters, d: float | None = None) -> SteadySolver:
    """The cell of one particle of a train, at its solution.

    Args:
        problem: The problem, whose `length` is the distance between centres.
        parameters: The parameters.
        d: Distance between facing surfaces [D_c], to which the length is adjusted; None to keep the length.

    Raises:
        NoSteadyState: No solution was found; `BranchEnd` if there is none.
        MeshFailure: A mesh could not be generated.
    """
    problem, long = replace(problem, closed=True, periodic=True), problem.betas[0]  # of a particle along the axis
    for _ in range(MOST_SPACINGS):
        found = arrived(first_scene(problem if d is None else replace(problem, length=d + long), parameters))
        if d is None or abs(off := distance(found) - d) <= SAME_DISTANCE * d:
            return found
        long -= off
        found.close()
    assert d is not None, "any distance is right where none is given"
    raise NoSteadyState(Message("the spacing at which facing surfaces are {} apart was not found", LENGTH(d, ".5g")))


def repeated(one: SteadySolver, count: int) -> SteadySolver:
    """A cell of several particles, at the solution that repeats that of a cell of one.

    Args:
        one: The cell of one particle, at its solution; it is left open.
        count: Number of particles.

    Raises:
        NoSteadyState: Newton's method does not confirm the repeated solution as one of the cell of several.
    """
    problem, here = one.problem, one.parameters
    parameters = Parameters((distance(one),) * (count - 1), here.solids * count, here.liquid, here.sizes * count)
    several = replace(problem.repeated(count), length=problem.length * count)
    mesh, nodes = one.scene.liquid.six_node_mesh.repeated(count, problem.length)
    insides = [None if body.phase is None else body.phase.six_node_mesh for body in one.bodies]
    cells = Cells(insides * count, one.scene.reference.repeated(count), mesh)
    train = SteadySolver(several, parameters, cells)
    (h_one, x_one), x = one.state(), np.zeros(train.scene.size)
    fields = [VELOCITY, *train.scene.material.transported]
    if train.scene.moving and one.scene.moving:
        fields.append(DISPLACEMENT)
    for at in nodes:
        for field in fields:
            train.scene.liquid.nodal(field.name, x)[at] = one.scene.liquid.nodal(field.name, x_one)
    y = free_unknowns(train.scene, train.constraints, x)
    for name in one.constraints.fields.keys() & {"U_p", "p_s"}:
        y[train.constraints.fields[name]] = np.tile(one.y[one.constraints.fields[name]], count)
    axial = np.arange(len(h_one)) % 2 == 0
    h = (h_one + np.outer(train.scene.reference.geometry.centres, axial)).ravel()
    material = train.constraints.M.tocoo()
    y[material.col] = (h - train.h_star(parameters))[material.row]
    report = train.solve(parameters, y)
    if not report.converged:
        train.close()
        raise NoSteadyState(f"a cell of {count} particles has no such solution as one of them: {report.reason}")
    return train

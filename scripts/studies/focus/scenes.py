"""Scenes with particles on the axis, and what moves them off it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from pairsim.fem.azimuthal.scene import DisturbedScene
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.solids.solid import Solid
from pairsim.runtime.arrays import Array
from pairsim.solvers.focus.rates import Disturbance, disturb
from pairsim.solvers.nonlinear.direct import DirectSolver
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.steady.scene import SteadySolver


@contextmanager
def scene(
    betas: tuple[float, ...],
    solids: tuple[Solid | None, ...],
    liquid: Liquid = NEWTONIAN,
    gaps: tuple[float, ...] = (),
    Np: int = 10,
) -> Iterator[SteadySolver]:
    """A scene at its quasi-steady solution, in a tube with developed flow at its ends."""
    length = 3.0 + sum(betas) + sum(gaps)
    problem = SteadyProblem(betas=betas, length=length, periodic=False, mesh=MeshSettings(Np=Np))
    solver = arrived(first_scene(problem, Parameters(gaps, solids, liquid)))
    try:
        yield solver
    finally:
        solver.close()


def disturbed(
    betas: tuple[float, ...],
    solids: tuple[Solid | None, ...],
    liquid: Liquid = NEWTONIAN,
    gaps: tuple[float, ...] = (),
    Np: int = 10,
) -> Disturbance:
    """What displacements of the particles of a scene do."""
    with scene(betas, solids, liquid, gaps, Np) as solver:
        return disturb(solver)


def disturbed_scene(solver: SteadySolver) -> DisturbedScene:
    """The linear equations of disturbances of the first azimuthal mode."""
    h, x = solver.state()
    return DisturbedScene(solver.scene, h, x, solver.y[solver.constraints.fields["U_p"]])


def resistance(beta: float, Np: int) -> Array:
    """Resistances of a sphere on the axis to lateral motion and rotation, over 6 pi a and 8 pi a^3."""
    with scene((beta,), (None,), Np=Np) as solver:
        found = disturbed_scene(solver)
        place = np.concatenate([found.constraints.lateral, found.constraints.rotation])
        forces = np.zeros((found.matrix.shape[0], 2))
        forces[place, [0, 1]] = 1.0
        linear = DirectSolver(found.matrix)
        matrix = np.linalg.inv(linear.solve(forces)[place])
        linear.close()
    assert np.abs(matrix - np.diag(np.diag(matrix))).max() < 1e-8, "motion and rotation are not coupled"
    return np.asarray(np.diag(matrix) / (np.pi * np.array([3 * beta, beta**3])))

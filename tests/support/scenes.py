"""Particles in a tube, solved in process without files."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pairsim.fem.algebra.constraints import PositionUpdate
from pairsim.fem.algebra.scene_constraints import transient_constraints
from pairsim.fem.body import make_bodies
from pairsim.fem.meshes.cell_sizes import make_outlines
from pairsim.fem.meshes.geometry import Geometry, MeshSettings, Reference
from pairsim.fem.meshes.meshing import liquid_mesh
from pairsim.fem.scene import Scene
from pairsim.physics.solids import soft
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.curve import trace
from pairsim.solvers.curves.point import Point
from pairsim.solvers.nonlinear.newton import Newton
from pairsim.solvers.problems import Problem
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.transient import Transient


@dataclass(frozen=True)
class Rigid:
    """Force-free rigid spheres in a Newtonian liquid."""

    U: np.ndarray
    dp_plus: float
    m: float


def solve_rigid(betas: tuple[float, ...], gaps: tuple[float, ...] = (), **mesh: float) -> Rigid:
    """Velocities and extra pressure drop, periodic ends, L = 50 D_p."""
    geometry = Geometry(betas, gaps, 50 * max(betas))
    settings = MeshSettings(**mesh)
    outlines = make_outlines(geometry, settings)
    reference = Reference.spheres(geometry, outlines)
    n = len(betas)
    bodies = make_bodies([None] * n, outlines, [None] * n)
    scene = Scene(reference, liquid_mesh(reference, settings), bodies, periodic=True)
    constraints = transient_constraints(scene)
    newton = Newton(scene, constraints)
    update = PositionUpdate(geometry.centres.copy(), 1e-3, 2 - 4 / 3 * betas[0] ** 2)
    y, report = newton.solve(np.zeros(constraints.size), update)
    assert report.converged, report
    _, x = constraints.state(y, update)
    newton.destroy()
    excess = scene.scalar_terms.pressure_drop(x) - 32 * geometry.length
    return Rigid(y[constraints.fields["U_p"]], excess, float(x[scene.m]))


def soft_pair(beta: float, d: float, Ca_e: float, **changes: object) -> Problem:
    """Two equal soft spheres on the default mesh of a case in a Newtonian liquid."""
    problem = Problem(
        betas=(beta, beta),
        solids=soft(Ca_e, Ca_e),
        gaps=(d,),
        length=50 * beta,
        periodic=True,
        mesh=MeshSettings(),
        control=StepControl(3e-4, 1e-8, 2.0),
        first_step=5e-4,
        U_m=2 * (1 - 2 / 3 * beta**2),
    )
    return replace(problem, **changes)  # type: ignore[arg-type]


def tube(length: float, mesh: MeshSettings, control: StepControl, first_step: float, **more: Any) -> Problem:
    """A tube without particles."""
    none: dict[str, Any] = {"betas": (), "solids": (), "gaps": ()}
    more = {"periodic": False, "length": length, "mesh": mesh, "control": control, "first_step": first_step} | more
    return Problem(**none, **more)


def march(problem: Problem, times: list[float]) -> list[Step]:
    """Every accepted step up to the last of the times, all of which are landed on."""
    transient = Transient(problem)
    try:
        return list(transient.steps(iter(times)))
    finally:
        transient.close()


def dU(step: Step) -> float:
    """Relative velocity of a pair."""
    return float(step.observation.dU[0])


def traced(solver: Branch, places: list[tuple[float, ...]], tol: float, max_points: int) -> list[Point]:
    """The points of a curve in ascending d."""
    return sorted((point for point, _ in map(arrived, trace(solver, places, tol, max_points))), key=lambda p: p.d)

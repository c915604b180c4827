"""The scene of quasi-steady solutions as a function of its parameters.

Distances are prescribed, and time derivatives at fixed X are dropped; see "Quasi-steady solutions" in
docs/explanation/numerics.md.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pairsim.fem import diagnostics
from pairsim.fem.algebra.constraints import Constraints
from pairsim.fem.algebra.scene_constraints import steady_base, steady_constraints
from pairsim.fem.meshes.geometry import Geometry, Reference
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.meshed_scene import MeshedScene, OnMeshedScene, cut_particles
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.developed_flow import DevelopedFlows


class ParametricScene(OnMeshedScene):
    """Base class of quasi-steady solutions: forms, constraints and meshes, which follow the parameters.

    Args:
        problem: The problem.
        parameters: Initial parameters. Rigid particles remain rigid, and materials keep their laws.

    Attributes:
        flows: Developed flows of the liquids so far.

    Raises:
        MeshFailure: The first mesh could not be generated.
        NoSteadyState: There is no developed flow of the initial liquid.
    """

    def __init__(self, problem: SteadyProblem, parameters: Parameters) -> None:
        self.problem, self.clock, self.flows = problem, Clock(), DevelopedFlows(problem.flow)
        geometry = Geometry(problem.betas, parameters.gaps, problem.length)
        narrowest = tuple(min(d, problem.narrowest) for d in parameters.gaps)
        with self.clock("mesh"):
            outlines, insides = cut_particles(problem.mesh, geometry, narrowest, parameters.solids)
        self.meshed = MeshedScene(
            problem,
            outlines,
            insides,
            parameters.solids,
            liquid=parameters.liquid,
            steady=True,
            constrain=self._constrain,
            clock=self.clock,
        )
        self._sphere_points: list[Array | None] = [
            None if b.phase is None else b.phase.mesh.geometry.x.copy() for b in self.bodies
        ]
        self.meshed.put(Reference.spheres(replace(geometry, gaps=problem.nominal(parameters.gaps)), outlines))

    def obey(self, monitor: Monitor) -> None:
        """Let another monitor end what is computed from now on."""
        self.problem = self.meshed.problem = replace(self.problem, monitor=monitor)
        self.newton.monitor = monitor

    def _constrain(self, meshed: MeshedScene) -> Constraints:
        """Constraints on a new mesh."""
        constraints = self._constraints_on(meshed)
        self._untouched = constraints.base.copy()
        return constraints

    def _constraints_on(self, meshed: MeshedScene) -> Constraints:
        return steady_constraints(meshed.scene)

    def h_star(self, parameters: Parameters) -> Array:
        """Material positions h* of undeformed spheres at the distances of the parameters, shape (n_h,)."""
        betas = tuple(beta * parameters.size for beta in self.problem.betas)
        centres = Geometry(betas, parameters.gaps, self.problem.length).centres
        h = np.zeros(self.scene.h_size)
        for body, centre in zip(self.bodies, centres, strict=True):
            h[body.start : body.start + body.size : 2] = centre
        return h

    def apply(self, parameters: Parameters) -> Array:
        """Set forms and constraints to the given parameters.

        Returns:
            Material positions h* of undeformed spheres, shape (n_h,).
        """
        scene, base = self.scene, self.constraints.base
        base[:] = self._untouched if parameters.size == 1.0 else steady_base(scene, parameters.size)
        for body, points, solid in zip(self.bodies, self._sphere_points, parameters.solids, strict=True):
            if body.phase is not None and points is not None and solid is not None:
                body.phase.become(solid)
                body.phase.mesh.geometry.x[:] = points * parameters.size
        scene.liquid.become(parameters.liquid)
        for phase in scene.phases:
            if "rate" in phase.constants:
                phase.constants["rate"].value = 0.0
        if not (scene.material.newtonian or scene.periodic):
            scene.prescribe_ends(base, self.flows.at(parameters.liquid))
        h_star = self.h_star(parameters)
        self.newton.place(h_star)
        return h_star

    def _state_at(self, parameters: Parameters, y: Array) -> tuple[Array, Array]:
        self.apply(parameters)
        return self.newton.state(y)

    def distortion_of(self, h: Array, x: Array) -> float:
        """Smallest ratio of current to reference Jacobian in the liquid; zero or negative if any cell is inverted."""
        solid = diagnostics.solid_distortion(self.bodies, h)
        return diagnostics.liquid_distortion(self.scene, x) if solid > 0 else 0.0

    def _shape_alone(self, distortion: float, parameters: Parameters, least: float) -> float:
        """Distortion of a mesh around spheres by the shapes alone, without the change of the distances.

        A mesh that only follows the distance of spheres remains accurate and symmetric; deformed shapes alone are a
        reason to replace it. Distortions of at least `least` are returned unchanged.
        """
        if distortion >= least or self.scene.reference.deformed:
            return distortion
        undeformed = diagnostics.liquid_distortion(self.scene, self.meshed.displaced(self.h_star(parameters)))
        return distortion / min(1.0, undeformed) if undeformed > 0 else distortion

    def close(self) -> None:
        """Free the memory of the solver."""
        self.meshed.close()

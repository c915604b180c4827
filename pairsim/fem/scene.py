"""A scene: the phases of a case on one mesh, their boundaries, and the full vector of all fields.

The full vector x, shape (n,), consists of the canonical vectors of the phases (the liquid, then the soft particles from
upstream), the Lagrange multiplier m of the zero mean pressure, with periodic ends the pressure drop dp, and the forces
F on particles whose velocity is prescribed, which are the Lagrange multipliers of that condition. The positions of the
particles' material form a second vector h, shape (n_h,) (`pairsim.fem.body`). Constraints
(`pairsim.fem.algebra.constraints`) define x as a function of the free unknowns and of h.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pairsim.fem.body import Body
from pairsim.fem.meshes.geometry import Reference
from pairsim.fem.meshes.liquid_nodes import LiquidNodes
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.phases.compiled_phase import liquid_phase
from pairsim.fem.phases.phase import Phase
from pairsim.fem.scalar_terms import ScalarTerms
from pairsim.physics.conformation import exponential
from pairsim.physics.drive import DEVELOPED, Drive
from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.liquids.conformation import LOG_CONFORMATION
from pairsim.physics.pipe import PipeState
from pairsim.physics.poiseuille import poiseuille
from pairsim.quantities.scales import FLOW_RATE
from pairsim.runtime.arrays import Array, Indices


def mesh_moves(particles: int, *, soft: bool, viscoelastic: bool, steady: bool) -> bool:
    """Whether the mesh of the liquid moves; forms for fixed meshes are cheaper.

    In the frame of a single rigid particle the mesh is at rest. In time-dependent problems of liquids with a memory it
    moves nevertheless, since the velocity of the frame is that of the particle at the previous step, and transported
    fields are convected relative to the mesh.

    Args:
        particles: Number of particles.
        soft: Whether any particle is deformable.
        viscoelastic: Whether the liquid has a memory.
        steady: Whether the problem is quasi-steady.
    """
    return soft or particles > (0 if viscoelastic and not steady else 1)


class Scene:
    """Phases, boundaries and scalar unknowns of a case on one reference mesh of the liquid.

    Args:
        reference: Reference domain of the liquid.
        mesh: Mesh of the reference domain.
        bodies: The particles, which the scenes before and after a remeshing share.
        periodic: Whether the ends are periodic, with an imposed flow rate; otherwise their velocity is prescribed.
        liquid: The liquid with its initial parameters.
        drive: What drives the liquid and the particles.
        steady: Whether the scene is quasi-steady; the velocity of the mesh is then the extension of the velocities of
            the particles into the liquid.

    Attributes:
        moving: Whether the mesh of the liquid moves.
        flow: Mean velocity of the liquid in the tube [U_av].
        size: Number n of entries of the full vector.
        h_size: Number n_h of entries of h.
        m: Index of the Lagrange multiplier of the zero mean pressure.
        dp: Index of the pressure drop, None unless the ends are periodic.
        F: Indices of the forces that move the particles at the prescribed velocity, shape (N,) or (0,).
        scalar_terms: The terms with m, dp and F.

    Raises:
        MeshFailure: The nodes of mesh and reference domain do not coincide.
    """

    def __init__(
        self,
        reference: Reference,
        mesh: SixNodeMesh,
        bodies: Sequence[Body],
        *,
        periodic: bool,
        liquid: Liquid = NEWTONIAN,
        drive: Drive = DEVELOPED,
        steady: bool = False,
    ) -> None:
        self.reference, self.bodies, self.periodic = reference, list(bodies), periodic
        self.drive, self.steady, self.flow = drive, steady, drive.flow
        soft = any(body.phase is not None for body in self.bodies)
        self.moving = mesh_moves(len(self.bodies), soft=soft, viscoelastic=liquid.has_memory, steady=steady)
        self.liquid = Phase(liquid_phase(liquid, self.moving, steady), mesh, liquid)
        self.nodes = LiquidNodes.find(mesh, reference)
        self.phases: list[Phase] = [self.liquid] + [b.phase for b in self.bodies if b.phase is not None]
        self.offsets = np.concatenate([[0], np.cumsum([phase.size for phase in self.phases])]).astype(np.int64)
        self.m = int(self.offsets[-1])
        self.dp = self.m + 1 if periodic else None
        first = self.m + (2 if periodic else 1)
        self.F = np.arange(first, first + (0 if drive.free else len(self.bodies)))
        self.size = first + len(self.F)
        self.scalar_terms = ScalarTerms(self.liquid, self.nodes, self.size, self.m, self.dp, self.F)
        self.h_size = sum(body.size for body in self.bodies)
        # The last flow at the ends, and its profiles there.
        self._at_ends: tuple[PipeState, list[dict[str, Array]]] | None = None

    @property
    def material(self) -> Liquid:
        """The liquid, with its current parameters."""
        return self.liquid.material

    @property
    def has_rates(self) -> bool:
        """Whether stresses depend on rates of change: of transported fields, or of the shapes of viscous solids."""
        viscous = (b.phase is not None and b.phase.material.viscosity is not None for b in self.bodies)
        return self.material.has_memory or any(viscous)

    def boundary_velocity(self, points: Array) -> Array:
        """Velocity at points on wall and prescribed ends, shape (k, 2) -> (k, 2): by the drive, or Poiseuille flow."""
        if self.drive.boundary is not None:
            return np.asarray(self.drive.boundary(points))
        return self.flow * poiseuille(points)

    def set_flow(self, x: Array, flow: float) -> None:
        """Change the mean velocity of the liquid [U_av]; at prescribed ends, set `boundary_velocity` in x."""
        self.flow = flow
        if not self.periodic:
            for nodes in (self.nodes.inlet, self.nodes.outlet):
                points = self.liquid.six_node_mesh.points[nodes]
                self.liquid.nodal("u", x)[nodes] = self.boundary_velocity(points)

    def offset(self, phase: Phase) -> int:
        """First index of a phase in the full vector."""
        return int(self.offsets[next(i for i, p in enumerate(self.phases) if p is phase)])

    def set(self, x: Array) -> None:
        """Set the unknowns of all phases from the full vector."""
        for phase, a, b in zip(self.phases, self.offsets[:-1], self.offsets[1:], strict=True):
            phase.set(x[a:b])

    @property
    def at_rest(self) -> Array:
        """Full vector of a liquid at rest in the reference domain, shape (n,)."""
        x = np.zeros(self.size)
        for field in self.material.transported:
            self.liquid.nodal(field.name, x)[:] = field.rest
        return x

    def conformations(self, x: Array) -> Array:
        """Conformations c of all modes at the nodes, from a full vector, shape (nodes, 4 M)."""
        return exponential(self.log_conformations(x))

    def log_conformations(self, x: Array) -> Array:
        """Logarithms of the conformations of all modes at the nodes, from a full vector, shape (nodes, 4 M)."""
        return self.liquid.nodal(LOG_CONFORMATION.name, x)

    def prescribe(self, x: Array, nodes: Indices, flow: PipeState) -> None:
        """Set the fields of the liquid at some nodes to those of a developed flow, in the full vector x."""
        self._set_profiles(x, nodes, flow.profiles(self.liquid.six_node_mesh.points[nodes, 1]))

    def _set_profiles(self, x: Array, nodes: Indices, profiles: Mapping[str, Array]) -> None:
        for name, values in profiles.items():
            self.liquid.nodal(name, x)[nodes, : values.shape[1]] = values

    def prescribe_ends(self, x: Array, flow: PipeState) -> None:
        """Set the fields at the ends of the liquid to those of a developed flow, in the full vector x."""
        ends = self.nodes.inlet, self.nodes.outlet
        if self._at_ends is None or self._at_ends[0] is not flow:
            points = self.liquid.six_node_mesh.points
            self._at_ends = flow, [flow.profiles(points[nodes, 1]) for nodes in ends]
        for nodes, profiles in zip(ends, self._at_ends[1], strict=True):
            self._set_profiles(x, nodes, profiles)

    def at_rest_between(self, flow: PipeState) -> Array:
        """Full vector of a developed flow at the ends, which decreases linearly to rest at the undeformed particles."""
        x = self.at_rest
        self.prescribe(x, np.arange(len(self.liquid.six_node_mesh.points)), flow)
        return self._resting(x)

    def starting(self, flow: float) -> Array:
        """Full vector of Newtonian flow of a mean velocity [U_av] at the ends, decreasing to rest at the particles."""
        x = self.at_rest
        self.liquid.nodal("u", x)[:] = flow * poiseuille(self.liquid.six_node_mesh.points)
        return self._resting(x)

    def _resting(self, x: Array) -> Array:
        """Scale the axial velocities in x, in place, to decrease linearly from the ends to 0 at the particles."""
        geometry, points = self.reference.geometry, self.liquid.six_node_mesh.points
        poles = np.sort(np.ravel(geometry.centres + np.outer([-0.5, 0.5], geometry.betas)))
        end = geometry.length / 2
        share = np.interp(points[:, 0], [-end, *poles, end], [1, *np.zeros(len(poles)), 1])
        self.liquid.nodal("u", x)[:, 0] *= share
        return x

    def set_step(self, star: Array, g: float, U_m: float, *, solids: bool = True) -> None:
        """Set the constants of a time step in the phases that have time derivatives.

        Args:
            star: Part of the full vector fixed by the time scheme, shape (n,).
            g: gamma dt.
            U_m: Velocity of the frame.
            solids: Whether to set those of viscous solids, too.
        """
        if self.material.has_memory:
            self.liquid.set_star(star[: self.liquid.size])
            self.liquid.constants["g"].value = g
            self.liquid.constants["U_m"].value = U_m
        if solids:
            self.set_solid_rates(star, 1 / g)

    def set_solid_rates(self, star: Array, rate: float) -> None:
        """Let the material of viscous solids have the velocity `rate` (eta - star), for a full vector star."""
        for body in self.bodies:
            if body.phase is not None and body.phase.material.viscosity is not None:
                start = self.offset(body.phase)
                body.phase.set_star(star[start : start + body.phase.size])
                body.phase.constants["rate"].value = rate

    def with_displacements(self, x: Array, h: Array) -> Array:
        """A full vector with the displacements of soft particles taken from the positions h, shape (n,)."""
        x = x.copy()
        for body in self.bodies:
            if body.phase is not None:
                body.phase.nodal("eta", x[self.offset(body.phase) :])[:] = body.displacement(h)
        return x

    def positions(self, x: Array) -> Array:
        """Current positions of the nodes of the liquid, shape (nodes, 2)."""
        mesh = self.liquid.six_node_mesh
        return mesh.points + self.liquid.nodal("eta", x) if self.moving else mesh.points

    def load(self) -> Array:
        """Constant part of the residual, the imposed flow rate and velocities, shape (n,)."""
        f = np.zeros(self.size)
        if self.dp is not None:
            f[self.dp] = FLOW_RATE * self.flow
        if self.drive.velocity is not None:
            f[self.F] = self.drive.velocity
        return f

    def overstretched(self, x: Array) -> str:
        """Message if tr c exceeds somewhere the bound beyond which a mode's law is not defined; otherwise empty."""
        for i, law in enumerate(self.material.modes):
            if law.largest_trace is None:
                continue
            c = exponential(self.log_conformations(x)[:, 4 * i : 4 * i + 4])
            trace = c[:, 0] + c[:, 2] + c[:, 3]
            top = int(np.argmax(trace))
            largest = float(trace[top])
            if not largest < law.largest_trace:
                z, r = self.positions(x)[top].tolist()
                bound = f"{law.largest_trace:g}, the bound of the {law.label} law"
                return f"tr c = {largest:.4g} at z = {z:.3f}, r = {r:.3f} exceeds {bound}"
        return ""

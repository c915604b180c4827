"""A disturbed scene: its phases, its constraints, and the equations of a disturbance."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pairsim.fem.algebra.mesh_velocity import shares
from pairsim.fem.azimuthal.constraints import DisturbedConstraints, disturbed_constraints
from pairsim.fem.azimuthal.motion import ON_AXIS
from pairsim.fem.azimuthal.nodal import derivative_along
from pairsim.fem.azimuthal.phase import DisturbedPhase
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array


def mesh_velocity(scene: Scene, U: Array) -> Array:
    """Velocity of the mesh at the vertices of the liquid for velocities of the particles, shape (v, 2)."""
    mesh = scene.liquid.six_node_mesh
    w = np.zeros((len(mesh.vertices), 2))
    w[:, 0] = U @ shares(scene.reference, mesh.points[mesh.vertices, 0], scene.periodic)
    return w


class DisturbedScene:
    """The first azimuthal mode of a scene about an axisymmetric solution.

    With the displacements d of the particles' centres its equations are

        E (N y + D d) = pinned d,    E = T A + pins;

    see `pairsim.fem.azimuthal.constraints`.

    Args:
        scene: The scene.
        h: Positions of the particles' material in the solution, shape (n_h,).
        x: Its full vector, shape (n,).
        U: Velocities of the particles in it [U_av], shape (N_p,).
        Re: Reynolds number.
        volume_modulus: Whether soft particles resist changes of volume within cells.

    Attributes:
        phases: The disturbed phases, in the order of the scene.
        A: Matrix of a disturbance at which nothing depends on its rate of change, shape (n, n).
        constraints: The constraints. Where all particles are rigid they contain the displacement of the mesh.

    Raises:
        ValueError: The tube is a period of an infinite row, whose disturbances do not have its period.
    """

    def __init__(
        self, scene: Scene, h: Array, x: Array, U: Array, *, Re: float = 0.0, volume_modulus: bool = False
    ) -> None:
        if scene.reference.geometry.closed:
            raise ValueError("disturbances of an infinite row do not have its period")
        self.scene, self._Re, self._remembers = scene, Re, bool(Re or scene.material.has_memory)
        base = x[: scene.liquid.size], mesh_velocity(scene, U)
        self.phases = [DisturbedPhase.liquid(scene.liquid, scene.positions(x), *base, Re)]
        for body in scene.bodies:
            if body.phase is not None:
                pressure = body.phase.nodal("p", x[scene.offset(body.phase) :]).ravel()
                solid = DisturbedPhase.solid(body.phase, body.positions(h), pressure, volume_modulus=volume_modulus)
                self.phases.append(solid)
        self.A = self._matrix(0.0)
        self._velocity = scene.liquid.nodal("u", x).copy()
        self.constraints = disturbed_constraints(scene, self.phases, h)
        if len(self.phases) == 1:
            self.constraints = self._extended(self.constraints)

    def _matrix(self, rate: float) -> sparse.csr_matrix:
        """The matrix of the full vector of a disturbance that grows as exp(rate t), shape (n, n)."""
        parts = [phase.matrix(rate) for phase in self.phases]
        return parts[0] if len(parts) == 1 else sparse.csr_matrix(sparse.block_diag(parts, format="csr"))

    @cached_property
    def memory(self) -> sparse.csr_matrix | None:
        """Matrix that multiplies the rate of change of the full vector, None without memory and inertia."""
        return sparse.csr_matrix(self._matrix(1.0) - self.A) if self._remembers else None

    def _extended(self, constraints: DisturbedConstraints) -> DisturbedConstraints:
        """The same with the extension of the displacements of rigid particles, which nothing else affects."""
        known = constraints.fields["eta"]
        equations = sparse.csr_matrix(constraints.T[known] @ self.A)
        factors = splu(sparse.csc_matrix(equations @ constraints.N[:, known]))
        return constraints.with_known(known, factors.solve(-(equations @ constraints.D).toarray()))

    @cached_property
    def equations(self) -> sparse.csr_matrix:
        """E = T A + pins, shape (n_y, n)."""
        return sparse.csr_matrix(self.constraints.T @ self.A + self.constraints.pins)

    @property
    def matrix(self) -> sparse.csr_matrix:
        """The matrix of the free unknowns, E N, shape (n_y, n_y)."""
        return sparse.csr_matrix(self.equations @ self.constraints.N)

    def load(self) -> Array:
        """Right-hand sides for unit displacements of the particles, shape (n_y, N_p)."""
        return np.asarray((self.constraints.pinned - self.equations @ self.constraints.D).toarray())

    def load_of_rates(self, y: Array, a: Array) -> Array:
        """What disturbances that change with the displacements add to the right-hand sides, shape (n_y, N_p).

        Args:
            y: Disturbances for unit displacements of the particles, shape (n_y, N_p).
            a: Rates of change of the displacements, dx_k/dt = sum_j a_kj x_j, shape (N_p, N_p).
        """
        c, x = self.constraints, self.expand(y)
        load = -self.equations @ ((c.follows @ x - c.moves.toarray()) @ a)
        if self.memory is not None:
            load -= c.T @ (self.memory @ (x @ a))
        if self._Re:
            load -= self._Re * (c.masses @ np.vstack([a @ a, y[c.rotation] @ a]))
        return np.asarray(load)

    def expand(self, y: Array) -> Array:
        """Disturbances for unit displacements of the particles, shape (n_y, N_p) -> (n, N_p)."""
        return np.asarray(self.constraints.N @ y + self.constraints.D.toarray())

    def velocity(self, x: Array) -> Array:
        """Disturbance of the velocity of the liquid at fixed points, the nodes of `phases[0].mesh`.

        In the plane of the displacements it is (u_z, u_r) where theta = 0, with the opposite u_z and the same velocity
        along the displacement where theta is 180 degrees. At particles it is not zero, as they are displaced.

        Args:
            x: A disturbance, shape (n,).

        Returns:
            Components u_z and u_r, times cos theta, and u_theta, times sin theta, shape (nodes, 3).
        """
        liquid = self.phases[0]
        eta, r = liquid.numbering.nodal("eta", x), liquid.mesh.points[:, 1]
        found = liquid.numbering.nodal("u", x).copy()
        found[:, :2] -= derivative_along(liquid.mesh, self._velocity, eta[:, :2])
        # The radial velocity turns with e_r where the mesh is displaced across the plane.
        off_axis = r > ON_AXIS
        found[off_axis, 2] -= self._velocity[off_axis, 1] * eta[off_axis, 2] / r[off_axis]
        found[~off_axis, 2] = -found[~off_axis, 1]
        return found

"""A disturbed scene: its phases, its constraints, and the equations of a disturbance."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import repeat

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pairsim.fem.algebra.mesh_velocity import shares
from pairsim.fem.azimuthal.constraints import DisturbedConstraints, disturbed_constraints
from pairsim.fem.azimuthal.motion import ON_AXIS
from pairsim.fem.azimuthal.nodal import derivative_along
from pairsim.fem.azimuthal.phase import DisturbedPhase
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array


def mesh_velocity(scene: Scene, U: Array) -> Array:
    """Velocity of the mesh at the vertices of the liquid for velocities of the particles, shape (v, 2)."""
    mesh = scene.liquid.six_node_mesh
    w = np.zeros((len(mesh.vertices), 2))
    w[:, 0] = U @ shares(scene.reference, mesh.points[mesh.vertices, 0], scene.periodic)
    return w


def diagonal(parts: list[sparse.csr_matrix]) -> sparse.csr_matrix:
    """The block-diagonal matrix of square parts; entries keep their order, so that nothing is sorted."""
    sizes = np.cumsum([0, *(part.shape[0] for part in parts)])
    entries = np.cumsum([0, *(part.nnz for part in parts)])
    data = np.concatenate([part.data for part in parts])
    columns = np.concatenate([part.indices + start for part, start in zip(parts, sizes[:-1], strict=True)])
    rows = [[0], *(part.indptr[1:] + start for part, start in zip(parts, entries[:-1], strict=True))]
    return sparse.csr_matrix((data, columns, np.concatenate(rows)), shape=(sizes[-1], sizes[-1]))


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
        like: The same scene about another solution on the same cells; what does not depend on the solution is reused.

    Attributes:
        phases: The disturbed phases, in the order of the scene.
        constraints: The constraints. If all particles are rigid, D contains the displacement of the mesh, which is then
            not among the free unknowns.

    Raises:
        ValueError: The tube is a period of an infinite row, whose disturbances do not have its period.
    """

    def __init__(
        self,
        scene: Scene,
        h: Array,
        x: Array,
        U: Array,
        *,
        Re: float = 0.0,
        volume_modulus: bool = False,
        like: DisturbedScene | None = None,
    ) -> None:
        if scene.reference.geometry.closed:
            raise ValueError("disturbances of an infinite row do not have its period")
        self.scene, self._Re, self._remembers = scene, Re, bool(Re or scene.material.has_memory)
        base = x[: scene.liquid.size], mesh_velocity(scene, U)
        others: Iterator[DisturbedPhase | None] = repeat(None) if like is None else iter(like.phases)
        self.phases: list[DisturbedPhase] = [
            DisturbedPhase.liquid(scene.liquid, scene.positions(x), *base, Re, next(others))
        ]
        for body in scene.bodies:
            if body.phase is not None:
                known = body.positions(h), body.phase.nodal("p", x[scene.offset(body.phase) :]).ravel()
                solid = DisturbedPhase.solid(body.phase, *known, volume_modulus=volume_modulus, like=next(others))
                self.phases.append(solid)
        self._velocity, self._pressure = (scene.liquid.nodal(name, x).copy() for name in ("u", "p"))
        self.constraints = self._constraints(h, like)

    def _constraints(self, h: Array, like: DisturbedScene | None) -> DisturbedConstraints:
        """The constraints; if all particles are rigid, they depend on the mesh alone and may be those of `like`."""
        rigid = len(self.phases) == 1
        if rigid and like is not None and np.array_equal(like.phases[0].mesh.points, self.phases[0].mesh.points):
            return like.constraints
        found = disturbed_constraints(self.scene, self.phases, h)
        return self._extended(found) if rigid else found

    @cached_property
    def A(self) -> sparse.csr_matrix:
        """Matrix without terms in the rate of change of the disturbance, shape (n, n)."""
        return diagonal([phase.matrix() for phase in self.phases])

    @cached_property
    def memory(self) -> sparse.csr_matrix | None:
        """Matrix that multiplies the rate of change of the full vector, (n, n); None without memory and inertia."""
        if not self._remembers:
            return None
        liquid, *solids = self.phases
        return diagonal([liquid.memory(), *(sparse.csr_matrix((each.numbering.size,) * 2) for each in solids)])

    def _extended(self, constraints: DisturbedConstraints) -> DisturbedConstraints:
        """Eliminate the displacement of the mesh, which depends on the displacements of rigid particles alone."""
        known = constraints.fields["eta"]
        equations = sparse.csr_matrix(constraints.T[known] @ self.A)
        factors = splu(sparse.csc_matrix(equations @ constraints.N[:, known]))
        return constraints.with_known(known, factors.solve(-(equations @ constraints.D).toarray()))

    @cached_property
    def equations(self) -> sparse.csr_matrix:
        """E = T A + pins, shape (n_y, n)."""
        return sparse.csr_matrix(self.constraints.T @ self.A + self.constraints.pins)

    @cached_property
    def matrix(self) -> sparse.csr_matrix:
        """The matrix of the free unknowns, E N, shape (n_y, n_y)."""
        return sparse.csr_matrix(self.equations @ self.constraints.N)

    def tested(self, x: Array) -> Array:
        """E x of full vectors, shape (n, k) -> (n_y, k), without E: a product of sparse matrices would cost more."""
        return np.asarray(self.constraints.T @ (self.A @ x) + self.constraints.pins @ x)

    def load(self) -> Array:
        """Right-hand sides for unit displacements of the particles, shape (n_y, N_p)."""
        return np.asarray(self.constraints.pinned.toarray() - self.tested(self.constraints.D.toarray()))

    @cached_property
    def _following(self) -> tuple[sparse.csr_matrix, Array]:
        """Contribution to the equations of the velocities that follow from rates of displacements at soft particles.

        Returns:
            The matrix that multiplies rates of change of the full vector, shape (n_y, n), and the part due to unit
            lateral velocities of the particles, which is counted already, shape (n_y, N_p).
        """
        c = self.constraints
        following = c.T @ (self.A @ c.follows) + c.pins @ c.follows
        return sparse.csr_matrix(following), self.tested(c.moves.toarray())

    def of_change(self, x: Array) -> Array:
        """Contribution of the rate of change x of the full vector to the equations, shape (n, k) -> (n_y, k)."""
        found = self._following[0] @ x
        return np.asarray(found if self.memory is None else found + self.constraints.T @ (self.memory @ x))

    def load_of_rates(self, y: Array, a: Array) -> Array:
        """Contribution of the rates of change of disturbances to the right-hand sides, shape (n_y, N_p).

        Args:
            y: Disturbances for unit displacements of the particles, shape (n_y, N_p).
            a: Rates of change of the displacements, dx_k/dt = sum_j a_kj x_j, shape (N_p, N_p).
        """
        load = self._following[1] @ a - self.of_change(self.expand(y) @ a)
        return np.asarray(load - self._of_masses(y, a))

    def _of_masses(self, y: Array, a: Array) -> Array | float:
        """Inertia of the accelerated particles in the equations; arguments as in `load_of_rates`."""
        if not self._Re:
            return 0.0
        c = self.constraints
        return np.asarray(self._Re * (c.masses @ np.vstack([a @ a, y[c.rotation] @ a])))

    def residual(self, y: Array, a: Array) -> Array:
        """Residual of the equations with the rates of change of the disturbances; arguments as in `load_of_rates`."""
        c, x = self.constraints, self.expand(y)
        rates = x @ a
        x = x + c.follows @ rates - c.moves @ a
        return np.asarray(c.T @ self._product(x, rates) + c.pins @ x - c.pinned.toarray() + self._of_masses(y, a))

    def _product(self, x: Array, rates: Array) -> Array:
        """Sum of A x and `memory` times the rates of change, shape (n, k)."""
        ends = np.cumsum([phase.numbering.size for phase in self.phases])[:-1]
        liquid, *solids = self.phases
        (of_liquid, *xs), (moving, *_) = np.split(x, ends), np.split(rates, ends)
        found = [liquid.product(of_liquid, moving if self._remembers else None)]
        found += [solid.product(each, None) for solid, each in zip(solids, xs, strict=True)]
        return np.concatenate(found)

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
        found[~off_axis, 0], found[~off_axis, 2] = 0.0, -found[~off_axis, 1]
        return found

    def pressure(self, x: Array) -> Array:
        """Disturbance of the pressure of the liquid at the same points, times cos theta, shape (nodes,).

        Args:
            x: A disturbance, shape (n,).
        """
        liquid = self.phases[0]
        own, axisymmetric = (
            at_nodes(liquid.mesh, values) for values in (liquid.numbering.nodal("p", x), self._pressure)
        )
        moved = derivative_along(liquid.mesh, axisymmetric, liquid.numbering.nodal("eta", x)[:, :2])
        return np.where(liquid.mesh.points[:, 1] > ON_AXIS, (own - moved)[:, 0], 0.0)


def at_nodes(mesh: SixNodeMesh, values: Array) -> Array:
    """Values at the vertices of a mesh, and their means at the nodes between them, shape (v, k) -> (n, k)."""
    found = np.zeros((len(mesh.points), values.shape[1]))
    found[mesh.vertices] = values
    return np.asarray(found[mesh.parents].mean(axis=1))

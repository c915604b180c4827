"""Stokes flow around a bead in half a tube that moves sideways, along the tube and about one axis, free of forces."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh
from dolfinx.fem import petsc
from petsc4py import PETSc as TypedPETSc

from studies.focus_3d.mesh import RADIUS, ROUNDING, Array

PETSc: Any = TypedPETSc  # whose stubs are incomplete

MOTIONS = ("V", "U", "Omega")
"""Velocity along x, along z, and rate of rotation about y."""
OPTIONS = {
    "ksp_type": "preonly",
    "pc_type": "lu",
    "pc_factor_mat_solver_type": "mumps",
    "mat_mumps_icntl_7": 5,
    "mat_mumps_icntl_14": 60,
}


class Places(NamedTuple):
    """Numbers of the velocity's nodes on the boundary, with the bead on the axis, and their positions."""

    bead: Array
    wall: Array
    ends: Array
    symmetry: Array
    points: Array


class Stokes:
    """The flow of viscosity 1 for given stresses, in the frame of the tube.

    Args:
        mesh: The mesh.
        places: Nodes on its boundary.
        centre: Position of the bead along x.
        inflow: Velocity at both ends at a radius.
    """

    def __init__(
        self, mesh: dolfinx_mesh.Mesh, places: Places, centre: float, inflow: Callable[[Array], Array]
    ) -> None:
        self.mesh, self.places, self.centre = mesh, places, centre
        self.space = space_of(mesh)
        self.velocity_space, at = self.space.sub(0).collapse()
        self.of_velocity = np.asarray(at).ravel()
        u, p = ufl.TrialFunctions(self.space)
        v, q = ufl.TestFunctions(self.space)
        self.dx = ufl.Measure("dx", domain=mesh, metadata={"quadrature_degree": 6})
        form = 2 * ufl.inner(ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v))) - p * ufl.div(v) - q * ufl.div(u)
        self.A = petsc.assemble_matrix(fem.form(form * self.dx))
        self.A.assemble()
        self.fixed = self._fixed()
        bound = self.A.copy()
        bound.zeroRowsColumns(self.fixed.astype(PETSc.IntType))
        self.ksp = PETSc.KSP().create(bound.comm)
        self.ksp.setOperators(bound)
        self.ksp.setOptionsPrefix("stokes_")
        for name, value in OPTIONS.items():
            PETSc.Options()[f"stokes_{name}"] = value
        self.ksp.setFromOptions()
        self.ksp.setUp()
        self.develop(inflow)
        self.rigid = [self._rigid(motion) for motion in MOTIONS]
        nothing = np.zeros(len(self.fixed_values))
        self.flows = [self._solved(nothing, g) for g in self.rigid]
        self.resistance = np.array([[w @ self.product(x) for x in self.flows] for w in self.rigid])

    def develop(self, inflow: Callable[[Array], Array]) -> None:
        """Set the velocity at both ends, a function of the radius."""
        nodes = self.places.ends
        self.inflow = self._boundary(nodes, 2, inflow(np.hypot(*self.places.points[nodes, :2].T)))

    def _fixed(self) -> Array:
        """Unknowns of the velocity that are given, and one of the pressure."""
        places, nodes = self.places, np.concatenate([self.places.bead, self.places.wall, self.places.ends])
        velocity = np.concatenate([(3 * nodes[:, None] + np.arange(3)).ravel(), 3 * places.symmetry + 1])
        _, pressure = self.space.sub(1).collapse()
        self.fixed_values = np.zeros(self.space.dofmap.index_map.size_local)
        return np.unique(np.append(self.of_velocity[velocity], np.asarray(pressure).ravel()[0]))

    def _boundary(self, nodes: Array, component: int, values: Array) -> Array:
        g = np.zeros_like(self.fixed_values)
        g[self.of_velocity[3 * nodes + component]] = values
        return g

    def _rigid(self, motion: str) -> Array:
        """Velocities on the bead."""
        nodes = self.places.bead
        x, _, z = self.places.points[nodes].T  # relative to the centre: the bead is displaced as a whole
        one = np.ones(len(nodes))
        match motion:
            case "V":
                return self._boundary(nodes, 0, one)
            case "U":
                return self._boundary(nodes, 2, one)
            case _:
                return self._boundary(nodes, 0, z) - self._boundary(nodes, 2, x)

    def product(self, x: Array) -> Array:
        """The matrix of all unknowns times a vector."""
        result = self.A.createVecLeft()
        self.A.mult(PETSc.Vec().createWithArray(x, comm=self.A.comm), result)
        return np.asarray(result.array).copy()

    def _solved(self, load: Array, g: Array) -> Array:
        rhs = load - self.product(g)
        rhs[self.fixed] = g[self.fixed]
        result = self.A.createVecRight()
        self.ksp.solve(PETSc.Vec().createWithArray(rhs, comm=self.A.comm), result)
        return np.asarray(result.array).copy()

    def free(self, load: Array) -> tuple[Array, Array]:
        """The flow of a bead on which no force and no torque act.

        Args:
            load: The load, tested with all functions.

        Returns:
            The flow, and the velocities of the bead in the order of `MOTIONS`.
        """
        given = self._solved(load, self.inflow)
        forces = np.array([w @ (self.product(given) - load) for w in self.rigid])
        motion = -np.linalg.solve(self.resistance, forces)
        return given + sum(q * x for q, x in zip(motion, self.flows, strict=True)), motion

    @property
    def drag(self) -> tuple[float, float]:
        """Resistances to lateral motion and to rotation without the other, over 6 pi a and 8 pi a^3."""
        lateral = self.resistance[np.ix_([0, 2], [0, 2])]
        a = float(np.linalg.norm(self.places.points[self.places.bead[0]]))
        return 2 * lateral[0, 0] / (6 * np.pi * a), 2 * lateral[1, 1] / (8 * np.pi * a**3)  # of the whole bead

    def close(self) -> None:
        """Free the memory of the factors."""
        self.ksp.destroy()
        self.A.destroy()


def space_of(mesh: dolfinx_mesh.Mesh) -> Any:
    """Taylor-Hood elements."""
    kinds = [
        basix.ufl.element("Lagrange", "tetrahedron", 2, shape=(3,)),
        basix.ufl.element("Lagrange", "tetrahedron", 1),
    ]
    return fem.functionspace(mesh, basix.ufl.mixed_element(kinds))


def places_in(mesh: dolfinx_mesh.Mesh, bead: float, half_length: float) -> Places:
    """The nodes on the boundary of a mesh whose bead is on the axis."""
    space, _ = space_of(mesh).sub(0).collapse()
    points = space.tabulate_dof_coordinates()
    on = {
        "bead": np.abs(np.linalg.norm(points, axis=1) - bead) < 1e3 * ROUNDING,
        "wall": np.hypot(points[:, 0], points[:, 1]) > RADIUS - 1e3 * ROUNDING,
        "ends": np.abs(points[:, 2]) > half_length - ROUNDING,
        "symmetry": np.abs(points[:, 1]) < ROUNDING,
    }
    return Places(**{name: np.flatnonzero(each) for name, each in on.items()}, points=points)

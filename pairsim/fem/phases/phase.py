"""A phase on its mesh: its unknowns, and the assembly of its residual and Jacobian.

A phase has one mixed function x on its own mesh. Its degrees of freedom are numbered canonically, independently of the
order in which DOLFINx has them: field after field, vector fields as (node, component), P1 fields by vertex. The phases
are joined by constraints (`pairsim.fem.algebra.constraints`).
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pairsim.fem.meshes.six_node_mesh import TO_BASIX, SixNodeMesh
from pairsim.fem.phases.compiled_phase import COORDINATE, OF_TIME, CompiledPhase, dofs_of
from pairsim.physics.fields import Field
from pairsim.physics.liquids import Liquid
from pairsim.physics.solids import Solid
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.fenicsx import MPI, dolfinx

fem = dolfinx.fem


@dataclass(frozen=True)
class CellJacobian:
    """The Jacobian of a phase cell by cell.

    Attributes:
        kernel: Compiled function that tabulates the matrix of a cell.
        dofs: Canonical numbers of the unknowns of each cell, shape (cells, k).
        coupled_pointer: Index in `coupled` at which the columns of each row of a cell's matrix begin, shape (k + 1,).
        coupled: Columns of the entries of a cell's matrix that can be non-zero, row by row.
        points: Coordinates of the nodes, shape (nodes, 3).
        nodes: Nodes of each cell, shape (cells, 6).
        packed: Function that returns the coefficients of all cells, their number in a cell, and the constants.
    """

    kernel: ctypes.c_void_p
    dofs: NDArray[np.int32]
    coupled_pointer: NDArray[np.int32]
    coupled: NDArray[np.int32]
    points: Array
    nodes: NDArray[np.int32]
    packed: Callable[[], tuple[Array, int, Array]]


class Phase[M: (Liquid, Solid)]:
    """A phase on its mesh.

    Args:
        compiled: Forms and fields.
        mesh: The mesh.
        material: What it is made of; its parameters are constants of the forms.

    Attributes:
        material: The same, with its current parameters.
        size: Number of canonical degrees of freedom.
        canonical: Canonical number of each degree of freedom of DOLFINx.
    """

    def __init__(self, compiled: CompiledPhase, mesh: SixNodeMesh, material: M) -> None:
        self.compiled, self.six_node_mesh = compiled, mesh
        self.mesh = dolfinx.mesh.create_mesh(MPI.COMM_SELF, mesh.cells[:, TO_BASIX], COORDINATE, mesh.points)
        self.space = fem.functionspace(self.mesh, compiled.element)
        self.x, self.star = fem.Function(self.space), fem.Function(self.space)
        self.offsets = self._offsets()
        self.canonical = self._number()
        self.constants = {name: fem.Constant(self.mesh, OF_TIME.get(name, 0.0)) for name in compiled.constants}
        self.material: M
        self.become(material)
        constant_map = {compiled.constants[k]: self.constants[k] for k in self.constants}

        functions = {compiled.x: self.x, compiled.star: self.star}
        self._residual = compiled.residual.on([self.space], functions, constant_map)
        self._jacobian = compiled.jacobian.on([self.space, self.space], functions, constant_map)
        self._vector = np.zeros(len(self.x.x.array))

    @property
    def fields(self) -> tuple[Field, ...]:
        """Its fields, in the order of its canonical degrees of freedom."""
        return self.compiled.fields

    def become(self, material: M) -> None:
        """Give the material other parameters; its laws stay the same."""
        self.material = material
        for name, value in material.numbers.items():
            self.constants[name].value = value

    @contextmanager
    def changed_to(self, material: M) -> Iterator[None]:
        """Context in which the material has other parameters, as by `become`; its own are restored at the end."""
        own = self.material
        self.become(material)
        try:
            yield
        finally:
            self.become(own)

    def _offsets(self) -> dict[str, int]:
        nodes, vertices = len(self.six_node_mesh.points), len(self.six_node_mesh.vertices)
        offsets, total = {}, 0
        for f in self.fields:
            offsets[f.name] = total
            total += f.components * (nodes if f.degree == 2 else vertices)
        self.size = total
        return offsets

    def carriers(self, name: str) -> Indices:
        """Nodes at which a field has degrees of freedom: all nodes (P2) or the vertices (P1)."""
        mesh = self.six_node_mesh
        return np.arange(len(mesh.points)) if self._field(name).degree == 2 else mesh.vertices

    def index(self, name: str, nodes: Indices, component: int = 0) -> Indices:
        """Canonical numbers of a component of a field at given nodes, which must be vertices for a P1 field."""
        f = self._field(name)
        at = nodes if f.degree == 2 else np.searchsorted(self.six_node_mesh.vertices, nodes)
        return np.asarray(self.offsets[name] + f.components * at + component)

    @property
    def nodes(self) -> Indices:
        """Node of each canonical degree of freedom, shape (size,)."""
        return np.concatenate([np.repeat(self.carriers(f.name), f.components) for f in self.fields])

    def _number(self) -> Indices:
        node = self.mesh.geometry.input_global_indices[self.mesh.geometry.dofmaps[0]]
        canonical = np.full(len(self.x.x.array), -1, dtype=np.int64)
        for i, f in enumerate(self.fields):
            for c, dofs in enumerate(dofs_of(self.space, i, f)):
                canonical[dofs] = self.index(f.name, node[:, : dofs.shape[1]], c)
        return canonical

    def nodal(self, name: str, values: Array) -> Array:
        """A field in a canonical vector, at the nodes that carry it: a view of shape (nodes, components)."""
        f, start, count = self._field(name), self.offsets[name], len(self.carriers(name))
        return values[start : start + f.components * count].reshape(-1, f.components)

    def at_nodes(self, name: str, values: Array) -> Array:
        """A field in a canonical vector at all nodes, at mid-sides of P1 fields by means, shape (nodes, components)."""
        nodal, mesh = self.nodal(name, values), self.six_node_mesh
        if self._field(name).degree == 2:
            return nodal
        everywhere = np.zeros((len(mesh.points), nodal.shape[1]))
        everywhere[mesh.vertices] = nodal
        return np.asarray(everywhere[mesh.parents].mean(axis=1))

    def _field(self, name: str) -> Field:
        return next(f for f in self.fields if f.name == name)

    def set(self, values: Array) -> None:
        """Set the unknowns from a canonical vector, shape (size,)."""
        self.x.x.array[:] = values[self.canonical]

    def set_star(self, values: Array) -> None:
        """Set the part fixed by the time scheme from a canonical vector, shape (size,)."""
        self.star.x.array[:] = values[self.canonical]

    def residual(self) -> Array:
        """The residual as a canonical vector, shape (size,)."""
        self._vector[:] = 0.0
        fem.assemble_vector(self._vector, self._residual)
        out = np.zeros(self.size)
        out[self.canonical] = self._vector
        return out

    def cell_jacobian(self) -> CellJacobian:
        """The Jacobian on the cells, at the state of the phase when it is evaluated."""
        dofs = self.canonical[self.space.dofmap.list].astype(np.int32)
        local = self.compiled.field_of_dof
        coupled = self.compiled.coupled[np.ix_(local, local)]
        return CellJacobian(
            ctypes.c_void_p(self.compiled.jacobian.kernel),
            dofs,
            np.concatenate([[0], np.cumsum(coupled.sum(axis=1))]).astype(np.int32),
            np.nonzero(coupled)[1].astype(np.int32),
            self.mesh.geometry.x,
            self.mesh.geometry.dofmaps[0],
            self._packed,
        )

    def _packed(self) -> tuple[Array, int, Array]:
        (coefficients,) = fem.pack_coefficients(self._jacobian).values()
        return coefficients, coefficients.shape[1], fem.pack_constants(self._jacobian)

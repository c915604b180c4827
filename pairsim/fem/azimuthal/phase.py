"""A disturbed phase on the mesh of the axisymmetric solution, at its current positions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy import sparse

from pairsim.fem.azimuthal.compiled import CompiledDisturbance, liquid_disturbance, solid_disturbance
from pairsim.fem.azimuthal.fields import Numbering
from pairsim.fem.meshes.six_node_mesh import TO_BASIX, SixNodeMesh
from pairsim.fem.phases.compiled_phase import COORDINATE
from pairsim.fem.phases.phase import Phase
from pairsim.physics.fields import MESH_VELOCITY
from pairsim.physics.liquids import Liquid
from pairsim.physics.solids import Solid
from pairsim.runtime.arrays import Array
from pairsim.runtime.fenicsx import MPI, dolfinx


class Assembly:
    """Assembles the matrix of the disturbances of a phase, for any positions of the nodes of the same cells.

    Args:
        compiled: The form.
        mesh: The cells; the positions of the nodes do not matter.

    Attributes:
        numbering: Canonical numbering of the disturbances.
    """

    def __init__(self, compiled: CompiledDisturbance, mesh: SixNodeMesh) -> None:
        cells = mesh.cells[:, TO_BASIX]
        put: Any = dolfinx.mesh.create_mesh(MPI.COMM_SELF, cells, COORDINATE, mesh.points)
        self._geometry, self.numbering = put.geometry, Numbering(put, mesh, compiled.fields)
        base_numbering = Numbering(put, mesh, compiled.base_fields)
        self._base, self._base_order = dolfinx.fem.Function(base_numbering.space), base_numbering.canonical
        self._constants = {name: dolfinx.fem.Constant(put, 0.0) for name in compiled.constants}
        by_symbol = {compiled.constants[name]: constant for name, constant in self._constants.items()}
        spaces = [self.numbering.space] * 2
        self._form = compiled.form.on(spaces, {compiled.base: self._base}, by_symbol)
        self._matrix = dolfinx.fem.create_matrix(self._form)
        self._pointer, self._indices = (each.astype(np.int32) for each in (self._matrix.indptr, self._matrix.indices))
        self._columns = self.numbering.canonical.astype(np.int32)[self._indices]
        self._rows = np.argsort(self.numbering.canonical)

    def entries(self, points: Array, base: Array, numbers: Mapping[str, float]) -> Array:
        """Entries of the matrix, in the order of DOLFINx.

        Args:
            points: Positions of the nodes, shape (n, 2).
            base: Fields of the axisymmetric solution as a canonical vector.
            numbers: Values of constants of the form by name; those that are missing are 0.
        """
        self._geometry.x[:, :2] = points[self._geometry.input_global_indices]
        self._base.x.array[:] = base[self._base_order]
        for name, constant in self._constants.items():
            constant.value = float(numbers.get(name, 0.0))
        self._matrix.set_value(0.0)
        dolfinx.fem.assemble_matrix(self._matrix, self._form)
        return np.array(self._matrix.data)

    def canonical(self, entries: Array) -> sparse.csr_matrix:
        """The matrix with given entries in the canonical numbering.

        Zeros, of which there are many as no equation depends on all fields, are removed.
        """
        size = self.numbering.size
        columns = sparse.csr_matrix((entries, self._columns, self._pointer), shape=(size, size), copy=True)
        columns.eliminate_zeros()
        return sparse.csr_matrix(columns[self._rows])

    def product(self, entries: Array, x: Array) -> Array:
        """The product of the matrix with given entries and canonical vectors, shape (size, k)."""
        at, size = self.numbering.canonical, self.numbering.size
        found = np.empty_like(x)
        found[at] = sparse.csr_matrix((entries, self._indices, self._pointer), shape=(size, size)) @ x[at]
        return found


class DisturbedPhase:
    """A phase with the matrix of its disturbances.

    Args:
        assembly: Assembles the matrix, for this solution and for others on the same cells.
        mesh: Mesh at the positions of the axisymmetric solution.
        base: Fields of that solution as a canonical vector.
        numbers: Constants of the form by name.

    Attributes:
        mesh: The mesh.
        numbering: Canonical numbering of the disturbances.
    """

    def __init__(self, assembly: Assembly, mesh: SixNodeMesh, base: Array, numbers: Mapping[str, float]) -> None:
        self.mesh, self.numbering = mesh, assembly.numbering
        self._assembly, self._base, self._numbers = assembly, base, numbers
        self._assembled = dict[float, Array]()

    @staticmethod
    def liquid(
        phase: Phase[Liquid], positions: Array, base: Array, w: Array, Re: float, like: DisturbedPhase | None = None
    ) -> DisturbedPhase:
        """The disturbed liquid of a scene.

        Args:
            phase: The liquid.
            positions: Current positions of its nodes, shape (n, 2).
            base: Its fields in the axisymmetric solution, a canonical vector.
            w: Velocity of the mesh in that solution at vertices, shape (v, 2).
            Re: Reynolds number.
            like: The same liquid in another solution, whose assembly is reused.
        """
        fields = phase.compiled.fields
        own = tuple(f for f in fields if f.name != MESH_VELOCITY.name)
        if own != fields:
            base = base[: phase.offsets[MESH_VELOCITY.name]]
        mesh = SixNodeMesh(positions, phase.six_node_mesh.cells)
        if like is None:
            assembly = Assembly(liquid_disturbance(phase.material, (*own, MESH_VELOCITY)), mesh)
        else:
            assembly = like._assembly
        numbers = {**phase.material.numbers, "Re": Re}
        return DisturbedPhase(assembly, mesh, np.concatenate([base, w.ravel()]), numbers)

    @staticmethod
    def solid(
        phase: Phase[Solid],
        positions: Array,
        pressure: Array,
        *,
        volume_modulus: bool,
        like: DisturbedPhase | None = None,
    ) -> DisturbedPhase:
        """The disturbed solid of a soft particle.

        Args:
            phase: The solid.
            positions: Current positions of its nodes, shape (n, 2).
            pressure: Its pressure, at vertices.
            volume_modulus: Whether it resists changes of volume within cells.
            like: The same solid in another solution, whose assembly is reused.
        """
        mesh = SixNodeMesh(positions, phase.six_node_mesh.cells)
        if like is None:
            assembly = Assembly(solid_disturbance(phase.material, volume_modulus=volume_modulus), mesh)
        else:
            assembly = like._assembly
        base = np.concatenate([phase.six_node_mesh.points.ravel(), pressure])
        return DisturbedPhase(assembly, mesh, base, dict(phase.material.numbers))

    def matrix(self) -> sparse.csr_matrix:
        """The matrix without terms in the rate of change of the disturbance, in the canonical numbering."""
        return self._assembly.canonical(self._entries(0.0))

    def memory(self) -> sparse.csr_matrix:
        """The matrix that multiplies the rate of change of the disturbance, in the canonical numbering."""
        return self._assembly.canonical(self._entries(1.0) - self._entries(0.0))

    def product(self, x: Array, rates: Array | None) -> Array:
        """The sum of `matrix` times disturbances x and, unless None, `memory` times their rates, shape (size, k).

        For a few products this costs less than making `matrix` and `memory`.
        """
        if rates is None:
            return self._assembly.product(self._entries(0.0), x)
        return self._assembly.product(self._entries(0.0), x - rates) + self._assembly.product(self._entries(1.0), rates)

    def _entries(self, rate: float) -> Array:
        """Entries of the matrix of a disturbance that grows as exp(rate t), in the order of DOLFINx."""
        if rate not in self._assembled:
            numbers = {**self._numbers, "rate": rate}
            self._assembled[rate] = self._assembly.entries(self.mesh.points, self._base, numbers)
        return self._assembled[rate]

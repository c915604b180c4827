"""A disturbed phase on the mesh of the axisymmetric solution, at its current positions."""

from __future__ import annotations

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


class DisturbedPhase:
    """A phase with the matrix of its disturbances.

    Args:
        compiled: Its form.
        mesh: Mesh at the positions of the axisymmetric solution.
        base: Fields of that solution as a canonical vector.
        material: What it is made of; its parameters are constants of the form.

    Attributes:
        mesh: The mesh.
        numbering: Canonical numbering of the disturbances.
    """

    def __init__(self, compiled: CompiledDisturbance, mesh: SixNodeMesh, base: Array, material: Liquid | Solid) -> None:
        self.mesh, self._compiled = mesh, compiled
        cells = mesh.cells[:, TO_BASIX]
        put: Any = dolfinx.mesh.create_mesh(MPI.COMM_SELF, cells, COORDINATE, mesh.points)
        self.numbering = Numbering(put, mesh, compiled.fields)
        base_numbering = Numbering(put, mesh, compiled.base_fields)
        function = dolfinx.fem.Function(base_numbering.space)
        function.x.array[:] = base[base_numbering.canonical]
        values = material.numbers
        self._constants = {name: dolfinx.fem.Constant(put, float(values.get(name, 0.0))) for name in compiled.constants}
        by_symbol = {compiled.constants[name]: constant for name, constant in self._constants.items()}
        spaces = [self.numbering.space] * 2
        self._form = compiled.form.on(spaces, {compiled.base: function}, by_symbol)
        self._matrix = dolfinx.fem.create_matrix(self._form)
        self._assembled = dict[float, Array]()

    @staticmethod
    def liquid(phase: Phase[Liquid], positions: Array, base: Array, w: Array, Re: float) -> DisturbedPhase:
        """The disturbed liquid of a scene.

        Args:
            phase: The liquid.
            positions: Current positions of its nodes, shape (n, 2).
            base: Its fields in the axisymmetric solution, a canonical vector.
            w: Velocity of the mesh in that solution at vertices, shape (v, 2).
            Re: Reynolds number.
        """
        fields = phase.compiled.fields
        own = tuple(f for f in fields if f.name != MESH_VELOCITY.name)
        if own != fields:
            base = base[: phase.offsets[MESH_VELOCITY.name]]
        compiled = liquid_disturbance(phase.material, (*own, MESH_VELOCITY))
        mesh = SixNodeMesh(positions, phase.six_node_mesh.cells)
        made = DisturbedPhase(compiled, mesh, np.concatenate([base, w.ravel()]), phase.material)
        made._constants["Re"].value = Re
        return made

    @staticmethod
    def solid(phase: Phase[Solid], positions: Array, pressure: Array, *, volume_modulus: bool) -> DisturbedPhase:
        """The disturbed solid of a soft particle.

        Args:
            phase: The solid.
            positions: Current positions of its nodes, shape (n, 2).
            pressure: Its pressure, at vertices.
            volume_modulus: Whether it resists changes of volume within cells.
        """
        compiled = solid_disturbance(phase.material, volume_modulus=volume_modulus)
        base = np.concatenate([phase.six_node_mesh.points.ravel(), pressure])
        return DisturbedPhase(compiled, SixNodeMesh(positions, phase.six_node_mesh.cells), base, phase.material)

    def matrix(self) -> sparse.csr_matrix:
        """The matrix of a disturbance at which nothing depends on its rate of change, in the canonical numbering."""
        return self._canonical(self._entries(0.0))

    def memory(self) -> sparse.csr_matrix:
        """The matrix that multiplies the rate of change of the disturbance, in the canonical numbering."""
        return self._canonical(self._entries(1.0) - self._entries(0.0))

    def _entries(self, rate: float) -> Array:
        """Entries of the matrix of a disturbance that grows as exp(rate t), in the order of DOLFINx."""
        if rate not in self._assembled:
            if "rate" in self._constants:
                self._constants["rate"].value = rate
            self._matrix.set_value(0.0)
            dolfinx.fem.assemble_matrix(self._matrix, self._form)
            self._assembled[rate] = self._matrix.data.copy()
        return self._assembled[rate]

    def _canonical(self, entries: Array) -> sparse.csr_matrix:
        """The matrix with given entries."""
        at, size = self.numbering.canonical, self.numbering.size
        columns = sparse.csr_matrix((entries, at[self._matrix.indices], self._matrix.indptr), shape=(size, size))
        return sparse.csr_matrix(columns[np.argsort(at)])

"""Fields of a disturbance in a liquid and in a solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.phases.compiled_phase import dofs_of, mixed_element
from pairsim.physics.fields import Field
from pairsim.physics.liquids import Liquid
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.fenicsx import dolfinx

VELOCITY = Field("u", 2, 3)
PRESSURE = Field("p", 1, 1)
DISPLACEMENT = Field("eta", 2, 3)
MATERIAL_VELOCITY = Field("v", 2, 3)
COMPONENTS = 6
"""Components of a symmetric tensor: zz, zr, rr, tt, zt, rt."""


def of_liquid(liquid: Liquid) -> tuple[Field, ...]:
    """Fields of a liquid's disturbance; chi is the relative disturbance of the conformation, of all modes."""
    scalars = tuple(Field(f.name, f.degree) for f in liquid.solvent.transported)
    count = len(liquid.modes)
    return VELOCITY, PRESSURE, *scalars, *((Field("chi", 2, COMPONENTS * count),) if count else ()), DISPLACEMENT


@dataclass(frozen=True)
class AxisCondition:
    """Conditions on components in (z, r, theta) on the axis: Cartesian components do not depend on theta there.

    Attributes:
        zero: Components that vanish.
        opposite: Pairs of components whose sum vanishes.
    """

    zero: tuple[int, ...]
    opposite: tuple[tuple[int, int], ...] = ()


VECTOR_ON_AXIS = AxisCondition((0,), ((1, 2),))
SCALAR_ON_AXIS = AxisCondition((0,))
TENSOR_ON_AXIS = AxisCondition((0, 2, 3, 5), ((1, 4),))


class Numbering:
    """The canonical numbering of fields on a mesh, as that of `pairsim.fem.phases.phase.Phase`.

    Args:
        mesh: The mesh as DOLFINx has it.
        six_node_mesh: The same as arrays.
        fields: The fields.

    Attributes:
        space: The mixed space of the fields.
        size: Number of degrees of freedom.
        canonical: Canonical number of each degree of freedom of DOLFINx.
    """

    def __init__(self, mesh: object, six_node_mesh: SixNodeMesh, fields: tuple[Field, ...]) -> None:
        self._mesh, self.fields = six_node_mesh, fields
        self.space = dolfinx.fem.functionspace(mesh, mixed_element(fields))
        self._start: dict[str, int] = {}
        total = 0
        for f in fields:
            self._start[f.name] = total
            total += f.components * len(self.carriers(f.name))
        self.size = total
        geometry = self.space.mesh.geometry
        node = geometry.input_global_indices[geometry.dofmaps[0]]
        self.canonical = np.full(total, -1, dtype=np.int64)
        for i, f in enumerate(fields):
            for c, dofs in enumerate(dofs_of(self.space, i, f)):
                self.canonical[dofs] = self.index(f.name, node[:, : dofs.shape[1]], c)

    def __contains__(self, name: str) -> bool:
        return name in self._start

    def field(self, name: str) -> Field:
        """The field with this name."""
        return next(f for f in self.fields if f.name == name)

    def carriers(self, name: str) -> Indices:
        """Nodes at which a field has degrees of freedom."""
        return np.arange(len(self._mesh.points)) if self.field(name).degree == 2 else self._mesh.vertices

    def index(self, name: str, nodes: Indices, component: int = 0) -> Indices:
        """Canonical numbers of a component of a field at nodes, which are vertices for a field of degree 1."""
        f = self.field(name)
        at = nodes if f.degree == 2 else np.searchsorted(self._mesh.vertices, nodes)
        return np.asarray(self._start[name] + f.components * at + component)

    def nodal(self, name: str, values: Array) -> Array:
        """A field in a canonical vector, at the nodes that carry it: a view of shape (nodes, components)."""
        f, start = self.field(name), self._start[name]
        return values[start : start + f.components * len(self.carriers(name))].reshape(-1, f.components)

"""The residual of a phase tested with discontinuous functions one degree higher than its fields, cell by cell.

Summed with the values of a weight at the nodes of these test functions it is the residual tested with that weight,
which need not lie in the space of the solution: what an estimate of the discretisation error asks for.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import basix.ufl
import numpy as np
import ufl

from pairsim.fem.compiled_phase import QUADRATURE_DEGREE, CompiledPhase, FieldSpec, Terms, compiled, components, split
from pairsim.fem.phases import TO_BASIX, Phase
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.fenicsx import dolfinx

fem = dolfinx.fem

# How the liquid's mesh follows its boundaries is a choice: these fields have no equation that an exact solution meets.
UNPHYSICAL = {"liquid": ("eta", "w"), "solid": ()}


@dataclass(frozen=True)
class EnrichedForm:
    """The enriched residual of one kind of phase, compiled without a mesh.

    Attributes:
        fields: The tested fields, with the degrees of their test functions.
        element: Element of the test functions.
        residual: The form.
    """

    fields: tuple[FieldSpec, ...]
    element: basix.ufl._ElementBase
    residual: Any


def enriched_form(phase: CompiledPhase) -> EnrichedForm:
    """Compile the enriched residual of a kind of phase, once for all scenes."""
    if "enriched" in phase.others:
        known: EnrichedForm = phase.others["enriched"]
        return known
    liquid = any(f.name == "u" for f in phase.fields)
    untested = UNPHYSICAL["liquid" if liquid else "solid"]
    fields = tuple(replace(f, degree=f.degree + 1) for f in phase.fields if f.name not in untested)
    element = discontinuous(fields)
    mesh = phase.x.ufl_function_space().ufl_domain()
    test = ufl.TestFunction(ufl.FunctionSpace(mesh, element))
    dX = ufl.Measure("dx", domain=mesh, metadata={"quadrature_degree": QUADRATURE_DEGREE + 1})
    x, star = split(phase.x, phase.fields), split(phase.star, phase.fields)
    residual = phase.build(Terms(mesh, x, star, split(test, fields), phase.constants, dX))
    phase.others["enriched"] = found = EnrichedForm(fields, element, compiled(residual))
    return found


def discontinuous(fields: Iterable[FieldSpec]) -> basix.ufl._ElementBase:
    """The mixed element of fields, discontinuous from cell to cell."""

    def element(field: FieldSpec) -> basix.ufl._ElementBase:
        shape = (field.components,) if field.components > 1 else None
        return basix.ufl.element("Lagrange", "triangle", field.degree, shape=shape, discontinuous=True)

    return basix.ufl.mixed_element([element(f) for f in fields])


def nodes_of(degree: int) -> Array:
    """Nodes of the test functions of a degree on the reference triangle, (n, 2)."""
    variant = basix.LagrangeVariant.gll_warped
    points: Array = basix.create_element(basix.ElementFamily.P, basix.CellType.triangle, degree, variant).points
    return points


class EnrichedResidual:
    """The enriched residual of a phase on its mesh.

    Args:
        phase: The phase; its unknowns and constants at each assembly count.

    Attributes:
        fields: The tested fields, with the degrees of their test functions.
        cells: Nodes of the cells in the order of `SixNodeMesh`, (m, 6).
    """

    def __init__(self, phase: Phase) -> None:
        form = enriched_form(phase.compiled)
        self.fields = form.fields
        space = fem.functionspace(phase.mesh, form.element)
        functions = {phase.compiled.x: phase.x, phase.compiled.star: phase.star}
        constants = {phase.compiled.constants[k]: constant for k, constant in phase.constants.items()}
        self._form = fem.create_form(form.residual, [space], phase.mesh, {}, functions, constants)
        geometry = phase.mesh.geometry
        cells = geometry.input_global_indices[geometry.dofmap]
        self.cells: Indices = np.asarray(cells[:, np.argsort(TO_BASIX)])
        self._dofs = {
            f.name: np.stack([part.dofmap.list for part in components(space, i, f)], axis=2)
            for i, f in enumerate(form.fields)
        }
        self._size = space.dofmap.index_map.size_local * space.dofmap.index_map_bs

    def assemble(self) -> dict[str, Array]:
        """The residual by field, for each cell, node and component of the test functions, (m, n, components)."""
        vector = np.zeros(self._size)
        fem.assemble_vector(vector, self._form)
        return {name: vector[dofs] for name, dofs in self._dofs.items()}

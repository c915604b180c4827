"""The residual of a phase at unknowns one degree above its fields, tested with its own test functions.

At the discrete solution plus what a recovery adds to it, this residual tells how far the discrete solution is from the
exact one, in the discrete space: the source of the error equation of `pairsim.solvers.errors.equation`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import basix.ufl
import numpy as np
import ufl

from pairsim.fem.compiled_phase import QUADRATURE_DEGREE, CompiledPhase, FieldSpec, Terms, compiled, components, split
from pairsim.fem.enriched_nodes import own_shapes
from pairsim.fem.enriched_residual import discontinuous
from pairsim.fem.phases import Phase
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.fenicsx import dolfinx

fem = dolfinx.fem

# What is added to each component of a field, by field: values at the nodes of one degree higher of each cell, (m, q).
Additions = dict[str, list[Array]]


@dataclass(frozen=True)
class RecoveredForm:
    """The residual of one kind of phase at recovered unknowns, compiled without a mesh.

    Attributes:
        fields: All fields, with the degrees of the recovered ones.
        element: Element of the unknowns: the fields one degree higher, discontinuous.
        residual: The form.
        x: Coefficient of the unknowns.
        star: Coefficient of the part of the unknowns that the time scheme fixes.
    """

    fields: tuple[FieldSpec, ...]
    element: basix.ufl._ElementBase
    residual: Any
    x: ufl.Coefficient
    star: ufl.Coefficient


def recovered_form(phase: CompiledPhase) -> RecoveredForm:
    """Compile the residual of a kind of phase, once for all scenes."""
    if "recovered" in phase.others:
        known: RecoveredForm = phase.others["recovered"]
        return known
    fields = tuple(replace(f, degree=f.degree + 1) for f in phase.fields)
    element = discontinuous(fields)
    mesh = phase.x.ufl_function_space().ufl_domain()
    space, test = ufl.FunctionSpace(mesh, element), ufl.TestFunction(phase.x.ufl_function_space())
    x, star = ufl.Coefficient(space), ufl.Coefficient(space)
    dX = ufl.Measure("dx", domain=mesh, metadata={"quadrature_degree": QUADRATURE_DEGREE})
    named = [split(function, fields) for function in (x, star, test)]
    residual = phase.build(Terms(mesh, named[0], named[1], named[2], phase.constants, dX))
    phase.others["recovered"] = found = RecoveredForm(fields, element, compiled(residual), x, star)
    return found


class RecoveredResidual:
    """The residual of a phase at recovered unknowns, on its mesh.

    Args:
        phase: The phase; its constants at each assembly count.

    Attributes:
        phase: The phase.
        fields: All fields by name, with the degrees of the recovered ones.
        cells: Numbers of the cells in the `SixNodeMesh`, (m,).
    """

    def __init__(self, phase: Phase) -> None:
        form = recovered_form(phase.compiled)
        self.phase, self.fields = phase, {f.name: f for f in form.fields}
        space = fem.functionspace(phase.mesh, form.element)
        self._x, self._star = fem.Function(space), fem.Function(space)
        functions = {form.x: self._x, form.star: self._star}
        constants = {phase.compiled.constants[k]: constant for k, constant in phase.constants.items()}
        self._form = fem.create_form(form.residual, [phase.space], phase.mesh, {}, functions, constants)
        self.cells: Indices = np.asarray(phase.mesh.topology.original_cell_index)
        nodes = phase.six_node_mesh.cells[self.cells]
        self._nodes = {2: nodes[:, :3], 3: nodes}
        self._dofs = {f.name: [part.dofmap.list for part in components(space, i, f)] for i, f in enumerate(form.fields)}
        self._vector = np.zeros(phase.x.x.array.size)

    def _set(self, function: Any, values: Array, additions: Additions) -> None:
        """Set a function to the fields of a canonical vector with additions."""
        phase = self.phase
        nodal = np.zeros(len(phase.six_node_mesh.points))
        for name, f in self.fields.items():
            carriers, own = phase.carriers(name), own_shapes(f.degree)
            for c, dofs in enumerate(self._dofs[name]):
                nodal[carriers] = values[phase.index(name, carriers, c)]
                found = nodal[self._nodes[f.degree]] @ own.T
                if name in additions:
                    found += additions[name][c]
                function.x.array[dofs] = found

    def assemble(self, x: Array, added: Additions, star: Array | None, star_added: Additions) -> Array:
        """This process's part of the residual.

        Args:
            x: Unknowns in the fields' own space as a canonical vector, (size,).
            added: What is added to them.
            star: The part that the time scheme fixes, None where there is none.
            star_added: What is added to that.

        Returns:
            A canonical vector, (size,).
        """
        self._set(self._x, x, added)
        if star is not None:
            self._set(self._star, star, star_added)
        self._vector[:] = 0.0
        fem.assemble_vector(self._vector, self._form)
        out = np.zeros(self.phase.size)
        out[self.phase.canonical] = self._vector
        return out

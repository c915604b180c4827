"""The residual of a phase one degree higher: tested with functions, or at unknowns, one degree above its fields.

The test functions one degree higher are discontinuous between cells. The sum of their residuals, multiplied by the
values of a weight at their nodes, is the residual tested with this weight, which need not lie in the space of the
solution. Estimates of the error of a functional need it.

The unknowns one degree higher are the discrete solution plus what a recovery adds to it, and stand in for the exact
solution. The residual at these, tested with the phase's own functions, is the source in the error equation of a run.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar, Literal

import basix.ufl
import numpy as np
import ufl

from pairsim.fem.phases.compiled_form import CompiledForm, compiled
from pairsim.fem.phases.compiled_phase import (
    QUADRATURE_DEGREE,
    CompiledPhase,
    Terms,
    dofs_of,
    mixed_element,
    split,
)
from pairsim.fem.phases.phase import Phase
from pairsim.fem.recovery.enriched_nodes import own_shapes
from pairsim.physics.fields import DISPLACEMENT, MESH_VELOCITY, VELOCITY, Field
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.fenicsx import dolfinx

fem = dolfinx.fem

Enriched = Literal["tests", "unknowns"]
"""Whether the test functions or the unknowns are one degree above the fields of a phase."""
Additions = dict[str, Array]
"""Additions to fields by name: values at the nodes of one degree higher in each cell, (m, q, components)."""


def physical(fields: Iterable[Field]) -> tuple[Field, ...]:
    """The fields of a phase without displacement and velocity of the liquid's mesh, which are arbitrary."""
    known = tuple(fields)
    chosen = (DISPLACEMENT.name, MESH_VELOCITY.name) if any(f.name == VELOCITY.name for f in known) else ()
    return tuple(f for f in known if f.name not in chosen)


@dataclass(frozen=True)
class EnrichedForm:
    """The residual of one kind of phase one degree higher, compiled without a mesh.

    Attributes:
        fields: The tested fields, or all fields of the unknowns, with their degrees raised by one.
        element: Element of the test functions or of the unknowns, discontinuous from cell to cell.
        residual: The form.
        x: Coefficient of the unknowns.
        star: Coefficient of the part of the unknowns that the time scheme fixes.
    """

    fields: tuple[Field, ...]
    element: basix.ufl._ElementBase
    residual: CompiledForm
    x: ufl.Coefficient
    star: ufl.Coefficient


@cache
def enriched_form(phase: CompiledPhase, what: Enriched) -> EnrichedForm:
    """Compile the residual of a kind of phase one degree higher, once for all scenes."""
    fields = physical(phase.fields) if what == "tests" else phase.fields
    fields = tuple(replace(f, degree=f.degree + 1) for f in fields)
    element, own = mixed_element(fields, discontinuous=True), phase.x.ufl_function_space()
    mesh = own.ufl_domain()
    space = ufl.FunctionSpace(mesh, element)
    if what == "tests":
        x, star, test, degree = phase.x, phase.star, split(ufl.TestFunction(space), fields), QUADRATURE_DEGREE + 1
    else:
        x, star, degree = ufl.Coefficient(space), ufl.Coefficient(space), QUADRATURE_DEGREE
        test = split(ufl.TestFunction(own), phase.fields)
    dX = ufl.Measure("dx", domain=mesh, metadata={"quadrature_degree": degree})
    residual = phase.build(
        Terms(mesh, split(x, phase.fields), split(star, phase.fields), test, phase.constants, dX),
    )
    return EnrichedForm(fields, element, compiled(residual), x, star)


class EnrichedResidual:
    """The residual of a phase one degree higher, on its mesh.

    Args:
        phase: The phase; each assembly uses its constants at that time.

    Attributes:
        what: Whether the test functions or the unknowns are one degree higher.
        phase: The phase.
        fields: The fields one degree higher, by name.
        cells: Numbers in the `SixNodeMesh` of the cells in the order of DOLFINx, (m,).
    """

    what: ClassVar[Enriched]

    def __init__(self, phase: Phase) -> None:
        form, own = enriched_form(phase.compiled, self.what), self.what == "unknowns"
        self.phase, self.fields = phase, {f.name: f for f in form.fields}
        space = fem.functionspace(phase.mesh, form.element)
        self._x, self._star = (fem.Function(space), fem.Function(space)) if own else (phase.x, phase.star)
        functions = {form.x: self._x, form.star: self._star}
        constants = {phase.compiled.constants[k]: constant for k, constant in phase.constants.items()}
        tests = phase.space if own else space
        self._form = form.residual.on([tests], functions, constants)
        self._vector = np.zeros(tests.dofmap.index_map.size_local * tests.dofmap.index_map_bs)
        self.cells: Indices = np.asarray(phase.mesh.topology.original_cell_index)
        self._dofs = {f.name: np.stack(dofs_of(space, i, f), axis=2) for i, f in enumerate(form.fields)}

    def _assembled(self) -> Array:
        self._vector[:] = 0.0
        fem.assemble_vector(self._vector, self._form)
        return self._vector


class EnrichedTests(EnrichedResidual):
    """The residual of a phase at its unknowns, tested with functions one degree higher."""

    what = "tests"

    def assemble(self) -> dict[str, Array]:
        """The residual by field, for each cell, node and component of the test functions, (m, q, components)."""
        vector = self._assembled()
        return {name: vector[dofs] for name, dofs in self._dofs.items()}


class EnrichedUnknowns(EnrichedResidual):
    """The residual of a phase at unknowns one degree higher, tested with its own functions."""

    what = "unknowns"

    def __init__(self, phase: Phase) -> None:
        super().__init__(phase)
        nodes = phase.six_node_mesh.cells[self.cells]
        self._nodes = {2: nodes[:, :3], 3: nodes}

    def _set(self, function: Any, values: Array, additions: Additions) -> None:
        """Set a function to the fields of a canonical vector with additions."""
        phase = self.phase
        nodal = np.zeros(len(phase.six_node_mesh.points))
        for name, f in self.fields.items():
            carriers, own = phase.carriers(name), own_shapes(f.degree)
            for c in range(f.components):
                nodal[carriers] = values[phase.index(name, carriers, c)]
                found = nodal[self._nodes[f.degree]] @ own.T
                if name in additions:
                    found += additions[name][..., c]
                function.x.array[self._dofs[name][..., c]] = found

    def assemble(self, x: Array, added: Additions, star: Array | None, star_added: Additions) -> Array:
        """The residual at x + added, with star + star_added in the time derivatives.

        Args:
            x: Unknowns in the fields' own space as a canonical vector, (size,).
            added: Additions to the unknowns.
            star: The part of the unknowns that the time scheme fixes, (size,); None without time derivatives.
            star_added: Additions to this part.

        Returns:
            A canonical vector, (size,).
        """
        self._set(self._x, x, added)
        if star is not None:
            self._set(self._star, star, star_added)
        out = np.zeros(self.phase.size)
        out[self.phase.canonical] = self._assembled()
        return out

"""Forms of liquids and solids, compiled without a mesh, once for all materials of the same laws."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

import basix.ufl
import numpy as np
import ufl
from numpy.typing import NDArray

from pairsim.fem.phases.compiled_form import CompiledForm, compiled
from pairsim.physics.fields import DISPLACEMENT, MESH_VELOCITY, PRESSURE_OF_SOLID, Field
from pairsim.physics.forms import constitutive, continuity, extra_stress, mesh_motion, transport
from pairsim.physics.forms.momentum import momentum
from pairsim.physics.kinematics import Expr, Kinematics
from pairsim.physics.liquids import Liquid
from pairsim.physics.liquids.conformation import LOG_CONFORMATION
from pairsim.physics.liquids.structured import StructuredLaw
from pairsim.physics.log_conformation import LogConformation
from pairsim.physics.solids import Solid
from pairsim.runtime.arrays import Indices
from pairsim.runtime.fenicsx import MPI, dolfinx

fem = dolfinx.fem

# Measured relative change of dU against degree 8, at Ca_e 0.15 and N_p 20: 3e-5 with degree 4, 1e-5 with degree 5,
# 5e-7 with degree 6.
QUADRATURE_DEGREE = 5
# Factor of the SUPG parameter, chosen: factors from 0.1 to 2 change dU by 0.3 % at De 2.
UPWIND_SCALE = 0.5
# Volume modulus of a solid over its shear modulus (docs/explanation/decisions.md, "Soft particles").
VOLUME_MODULUS = 1.0
COORDINATE = basix.ufl.element("Lagrange", "triangle", 2, shape=(2,))
"""Element of the coordinates of six-node triangles."""
OF_TIME = {"rate": 0.0, "g": 1.0, "U_m": 0.0}
"""Constants of the time scheme, with their initial values."""


@dataclass(frozen=True, eq=False)
class CompiledPhase:
    """Forms of one kind of phase, compiled without a mesh.

    Attributes:
        kind: Key of the kind of phase.
        fields: Fields of the phase, in the order of the mixed element.
        element: Mixed element.
        residual: Compiled residual.
        jacobian: Compiled derivative of the residual with respect to x.
        field_of_dof: Number of the field of each degree of freedom of a cell.
        coupled: Blocks of the Jacobian that can be non-zero, shape (fields, fields).
        x: Coefficient of the unknowns.
        star: Coefficient of the part of the unknowns that the time scheme fixes.
        constants: Constants of the forms by name.
        build: Builds the residual, with any test functions.
    """

    kind: tuple[str | bool | type[Any], ...]
    fields: tuple[Field, ...]
    element: basix.ufl._ElementBase
    residual: CompiledForm
    jacobian: CompiledForm
    field_of_dof: Indices
    coupled: NDArray[np.bool_]
    x: ufl.Coefficient
    star: ufl.Coefficient
    constants: dict[str, ufl.Constant]
    build: Callable[[Terms], ufl.Form]

    @property
    def timed(self) -> bool:
        """Whether the forms have time derivatives."""
        return bool(self.constants.keys() & OF_TIME.keys())


@dataclass(frozen=True)
class Terms:
    """Ingredients of a form: the unknowns x, their part `star` fixed by the time scheme, test functions, constants.

    A field without a test function has no equation in the form.
    """

    mesh: ufl.Mesh
    x: dict[str, Expr]
    star: dict[str, Expr]
    test: dict[str, Expr]
    constants: dict[str, ufl.Constant]
    dX: ufl.Measure


def mixed_element(fields: Iterable[Field], discontinuous: bool = False) -> basix.ufl._ElementBase:
    """The mixed element of fields, continuous or discontinuous from cell to cell."""
    shapes = [(f, (f.components,) if f.components > 1 else None) for f in fields]
    element = partial(basix.ufl.element, "Lagrange", "triangle", discontinuous=discontinuous)
    return basix.ufl.mixed_element([element(f.degree, shape=shape) for f, shape in shapes])


def split(function: Any, fields: tuple[Field, ...]) -> dict[str, Expr]:
    """The fields of a mixed function by name."""
    return dict(zip((f.name for f in fields), ufl.split(function), strict=True))


def dofs_of(space: Any, i: int, field: Field) -> list[Indices]:
    """Degrees of freedom of each component of field i of a mixed space, (cells, nodes)."""
    part = space._cpp_object.sub([i])
    parts = [part.sub([c]) for c in range(field.components)] if field.components > 1 else [part]
    return [part.dofmap.map() for part in parts]


def _blocks(
    element: basix.ufl._ElementBase, fields: tuple[Field, ...], create: Callable[..., Any]
) -> tuple[Indices, NDArray[np.bool_]]:
    """Field of each degree of freedom of a cell, and blocks of the Jacobian that can be non-zero (fields, fields).

    They are detected in the matrix of one cell with random values of all unknowns and constants: a block to which no
    term contributes is exactly zero. A symbolic analysis with UFL would take seconds for a viscoelastic liquid.
    """
    triangle = np.array([[0.1, 0.3], [0.9, 0.2], [0.4, 0.8], [0.65, 0.5], [0.25, 0.55], [0.5, 0.25]])
    cells = np.arange(6, dtype=np.int64)[None, :]
    space = fem.functionspace(dolfinx.mesh.create_mesh(MPI.COMM_SELF, cells, COORDINATE, triangle), element)
    random = np.random.default_rng(0)
    form = create(space, lambda: random.uniform(0.2, 0.8))
    dense = fem.assemble_matrix(form).to_dense()
    blocks = [np.ravel([dofs[0] for dofs in dofs_of(space, i, f)]) for i, f in enumerate(fields)]
    field_of_dof = np.empty(element.dim, dtype=np.int64)
    for number, dofs in enumerate(blocks):
        # Degrees of freedom of the only cell are numbered as those of the space, not necessarily in the cell's order.
        field_of_dof[np.isin(space.dofmap.list[0], dofs)] = number
    return field_of_dof, np.array([[bool(np.any(dense[np.ix_(i, j)] != 0)) for j in blocks] for i in blocks])


_COMPILED: dict[tuple[str | bool | type[Any], ...], CompiledPhase] = {}


def _compile(
    kind: tuple[str | bool | type[Any], ...],
    fields: tuple[Field, ...],
    constant_names: tuple[str, ...],
    build: Callable[[Terms], ufl.Form],
) -> CompiledPhase:
    """Compile the forms of a kind of phase, or return them if they were compiled before."""
    if kind in _COMPILED:
        return _COMPILED[kind]
    mesh, element = ufl.Mesh(COORDINATE), mixed_element(fields)
    space = ufl.FunctionSpace(mesh, element)
    x, star, test = ufl.Coefficient(space), ufl.Coefficient(space), ufl.TestFunction(space)
    # Constants are counted here: UFL sorts them by their counts as text, 9 after 10, so that with counts of its global
    # counter the signature of the same form would differ between processes.
    constants = {name: ufl.Constant(mesh, count=i) for i, name in enumerate(constant_names)}
    named = [split(function, fields) for function in (x, star, test)]
    dX = ufl.Measure("dx", domain=mesh, metadata={"quadrature_degree": QUADRATURE_DEGREE})
    residual = build(Terms(mesh, named[0], named[1], named[2], constants, dX))
    jacobian = ufl.derivative(residual, x, ufl.TrialFunction(space))

    compiled_jacobian = compiled(jacobian)

    def on_one_cell(space: Any, value: Callable[[], float]) -> Any:
        functions = {c: fem.Function(space) for c in (x, star)}
        for function in functions.values():
            function.x.array[:] = [value() for _ in function.x.array]
        values = {c: fem.Constant(space.mesh, value()) for c in constants.values()}
        return compiled_jacobian.on([space, space], functions, values)

    field_of_dof, coupled = _blocks(element, fields, on_one_cell)
    _COMPILED[kind] = CompiledPhase(
        kind, fields, element, compiled(residual), compiled_jacobian, field_of_dof, coupled, x, star, constants, build
    )
    return _COMPILED[kind]


def liquid_phase(liquid: Liquid, moving: bool, steady: bool = False) -> CompiledPhase:
    """The forms of a liquid, with its own fields and, if the mesh moves, the displacement eta.

    In time-dependent problems the velocity of the mesh follows from eta. In quasi-steady problems it is a field w, and
    the time derivatives of the transported fields are `rate` times their change, with the constant `rate` 0 in a
    quasi-steady solve and 1/dt in a step of pseudo-time. A liquid without a memory has no time derivatives and no w.

    Args:
        liquid: The liquid; forms depend on its laws, and its parameters are their constants.
        moving: Whether the mesh moves.
        steady: Whether the problem is quasi-steady.
    """
    transported, steady = liquid.transported, steady and liquid.has_memory

    def build(terms: Terms) -> ufl.Form:
        x, star, test, k, dX = terms.x, terms.star, terms.test, terms.constants, terms.dX
        kin = Kinematics.of(terms.mesh, x.get("eta"))
        here = liquid.with_numbers({name: k[name] for name in liquid.numbers})
        u, state = x["u"], [x[f.name] for f in here.solvent.transported]
        stress = extra_stress.solvent(kin, u, here, *state)
        logs = [LogConformation.of(mode_part(x[LOG_CONFORMATION.name], i)) for i in range(len(here.modes))]
        for law, s in zip(here.modes, logs, strict=True):
            tau = extra_stress.mode(kin, s, u, here, law)
            stress = stress[0] + tau[0], stress[1] + tau[1]
        form = momentum(kin, stress, x["p"], test["u"], dX)
        form += continuity.liquid(kin, u, test["p"], dX)
        if "eta" in test:
            form += mesh_motion.elastic_extension(terms.mesh, x["eta"], test["eta"], dX)
        if not transported:
            return form
        changes = {f.name: x[f.name] - star[f.name] for f in transported}
        if steady:
            v, changes = u - x["w"], {name: change * k["rate"] for name, change in changes.items()}
        else:
            v, changes = u, {name: change / k["g"] for name, change in changes.items()}
            if moving:
                v = v - ufl.as_vector([k["U_m"], 0]) - (x["eta"] - star["eta"]) / k["g"]
        rates = {name: change + ufl.dot(kin.grad(x[name]), v) for name, change in changes.items()}
        if isinstance(here.solvent, StructuredLaw):
            own = here.solvent.rates(extra_stress.gamma2(kin, u), *state)
            time = constitutive.upwind_time(terms.mesh, v, here.solvent.memory, UPWIND_SCALE)
            for f, rate in zip(here.solvent.transported, own, strict=True):
                form += transport.scalar(kin, rates[f.name] - rate, test[f.name], v, time, dX)
        for i, (law, s) in enumerate(zip(here.modes, logs, strict=True)):
            rate, De = LogConformation.of(mode_part(rates[LOG_CONFORMATION.name], i)), here.relaxation_time(law)
            relaxed = constitutive.relaxation(kin, s, u, here, law)
            strong = constitutive.residual(kin, s, (rate.block, rate.hoop), u, relaxed, De)
            time = constitutive.upwind_time(terms.mesh, v, De, UPWIND_SCALE)
            form += constitutive.constitutive(kin, strong, mode_part(test[LOG_CONFORMATION.name], i), v, time, dX)
        return form

    fields = (*liquid.fields, *((DISPLACEMENT,) if moving else ()), *((MESH_VELOCITY,) if steady else ()))
    of_time = ("rate",) if steady else ("g", "U_m") if transported else ()
    laws = [type(each) for each in (liquid.solvent, *liquid.modes, liquid.yielding)]  # two laws may share a name
    return _compile((liquid.structure, *laws, moving, steady), fields, (*liquid.numbers, *of_time), build)


def mode_part(s: Expr, i: int) -> Expr:
    """The four components of mode i in a field of all modes."""
    return ufl.as_vector([s[4 * i + c] for c in range(4)])


def solid_phase(solid: Solid, volume_modulus: bool = False) -> CompiledPhase:
    """The forms of a solid, with the fields eta and p.

    The viscous stress of a viscous solid is that of the velocity `rate` (eta - star), with the constant `rate`
    1/(gamma dt) in a time step and 0 in a quasi-steady solve.

    Args:
        solid: Its law.
        volume_modulus: Whether a volume modulus resists the changes of volume within cells that the P1 pressure does
            not prevent, and that make a compressed surface too soft against waves as long as cells. It does nothing
            where J R/r = 1.
    """

    def build(terms: Terms) -> ufl.Form:
        x, test, k, dX = terms.x, terms.test, terms.constants, terms.dX
        kin = Kinematics.of(terms.mesh, x["eta"])
        here = solid.with_numbers({name: k[name] for name in solid.numbers})
        stress = extra_stress.elastic(kin, here)
        if here.viscosity is not None:
            v = k["rate"] * (x["eta"] - terms.star["eta"])
            more = extra_stress.viscous(kin, v, here.viscosity)
            stress = stress[0] + more[0], stress[1] + more[1]
        p = x["p"]
        if volume_modulus:
            p = p - VOLUME_MODULUS / k["Ca_e"] * continuity.expansion(kin)
        return momentum(kin, stress, p, test["eta"], dX) + continuity.solid(kin, test["p"], dX)

    names = (*solid.numbers, *(("rate",) if solid.viscosity is not None else ()))
    return _compile((solid.name, type(solid), volume_modulus), (DISPLACEMENT, PRESSURE_OF_SOLID), names, build)

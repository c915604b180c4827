"""Discretisation of liquids and solids: the fields of a phase, its compiled forms, and their assembly.

A phase has one mixed function x on its own mesh. Its degrees of freedom are numbered canonically, independently of the
distribution over processes: field after field, vector fields as (node, component), P1 fields by vertex. The phases are
joined by constraints (`pairsim.fem.constraints`). Assembled vectors and matrices are the contributions of one process;
they are summed over processes elsewhere.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import basix.ufl
import numpy as np
import ufl
from numpy.typing import NDArray

from pairsim.fem.cell_loop import CellJacobian
from pairsim.fem.jit import JIT_OPTIONS
from pairsim.fem.six_node_mesh import SixNodeMesh
from pairsim.physics.forms import constitutive, continuity, mesh_motion
from pairsim.physics.forms.momentum import momentum
from pairsim.physics.kinematics import Expr, Kinematics
from pairsim.physics.materials import neo_hookean, newtonian, polymer
from pairsim.physics.materials.log_conformation import LogConformation
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.fenicsx import MPI, dolfinx

fem = dolfinx.fem

# Measured relative change of dU against degree 8, at Ca_e 0.15 and N_p 20: 3e-5 with degree 4, 1e-5 with degree 5,
# 5e-7 with degree 6.
QUADRATURE_DEGREE = 5
# Factor of the SUPG parameter, chosen: factors from 0.1 to 2 change dU by 0.3 % at De 2.
UPWIND_SCALE = 0.5
# basix numbers mid-side nodes by the opposite vertex, gmsh by the first vertex of the side.
TO_BASIX = np.array([0, 1, 2, 4, 5, 3])


@dataclass(frozen=True)
class FieldSpec:
    """One field of a phase.

    Attributes:
        name: Its symbol.
        degree: Lagrange degree.
        components: Their number.
        odd: Components that are odd functions of r; the others are even.
    """

    name: str
    degree: int
    components: int
    odd: tuple[int, ...] = ()


VELOCITY = FieldSpec("u", 2, 2, odd=(1,))
DISPLACEMENT = FieldSpec("eta", 2, 2, odd=(1,))
PRESSURE = FieldSpec("p", 1, 1)
LOG_CONFORMATION = FieldSpec("s", 2, 4, odd=(1,))
MESH_VELOCITY = FieldSpec("w", 1, 2, odd=(1,))


@dataclass(frozen=True)
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
        build: Makes the residual for any test functions.
    """

    kind: tuple[str | bool, ...]
    fields: tuple[FieldSpec, ...]
    element: basix.ufl._ElementBase
    residual: Any
    jacobian: Any
    field_of_dof: Indices
    coupled: NDArray[np.bool_]
    x: ufl.Coefficient
    star: ufl.Coefficient
    constants: dict[str, ufl.Constant]
    build: Callable[[Terms], ufl.Form]


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


def split(function: Any, fields: tuple[FieldSpec, ...]) -> dict[str, Expr]:
    """The fields of a mixed function by name."""
    return dict(zip((f.name for f in fields), ufl.split(function), strict=True))


def components(space: Any, i: int, field: FieldSpec) -> list[Any]:
    """Scalar subspaces of field i of a mixed space."""
    return [space.sub(i).sub(c) for c in range(field.components)] if field.components > 1 else [space.sub(i)]


def _blocks(
    element: basix.ufl._ElementBase, fields: tuple[FieldSpec, ...], create: Callable[..., Any]
) -> tuple[Indices, NDArray[np.bool_]]:
    """Field of each degree of freedom of a cell, and blocks of the Jacobian that can be non-zero (fields, fields).

    They are detected in the matrix of one cell with random values of all unknowns and constants, in which blocks
    without any form are exactly zero. The symbolic analysis with UFL takes seconds for a viscoelastic liquid.
    """
    triangle = np.array([[0.1, 0.3], [0.9, 0.2], [0.4, 0.8], [0.65, 0.5], [0.25, 0.55], [0.5, 0.25]])
    coordinate = basix.ufl.element("Lagrange", "triangle", 2, shape=(2,))
    cells = np.arange(6, dtype=np.int64)[None, :]
    space = fem.functionspace(dolfinx.mesh.create_mesh(MPI.COMM_SELF, cells, coordinate, triangle), element)
    random = np.random.default_rng(0)
    form = create(space, lambda: random.uniform(0.2, 0.8))
    dense = fem.assemble_matrix(form).to_dense()
    blocks = [np.ravel([part.dofmap.list[0] for part in components(space, i, f)]) for i, f in enumerate(fields)]
    field_of_dof = np.empty(element.dim, dtype=np.int64)
    for number, dofs in enumerate(blocks):
        # Degrees of freedom of the only cell are numbered as those of the space, not necessarily in the cell's order.
        field_of_dof[np.isin(space.dofmap.list[0], dofs)] = number
    return field_of_dof, np.array([[bool(np.any(dense[np.ix_(i, j)] != 0)) for j in blocks] for i in blocks])


_COMPILED: dict[tuple[str | bool, ...], CompiledPhase] = {}


def _compile(
    comm: MPI.Comm,
    kind: tuple[str | bool, ...],
    fields: tuple[FieldSpec, ...],
    constant_names: tuple[str, ...],
    build: Callable[[Terms], ufl.Form],
) -> CompiledPhase:
    """Compile the forms of a kind of phase, or return them if they were compiled before; collective."""
    if kind in _COMPILED:
        return _COMPILED[kind]
    mesh = ufl.Mesh(basix.ufl.element("Lagrange", "triangle", 2, shape=(2,)))
    element = basix.ufl.mixed_element(
        [
            basix.ufl.element("Lagrange", "triangle", f.degree, shape=(f.components,) if f.components > 1 else None)
            for f in fields
        ]
    )
    space = ufl.FunctionSpace(mesh, element)
    x, star, test = ufl.Coefficient(space), ufl.Coefficient(space), ufl.TestFunction(space)
    constants = {name: ufl.Constant(mesh) for name in constant_names}
    named = [split(function, fields) for function in (x, star, test)]
    dX = ufl.Measure("dx", domain=mesh, metadata={"quadrature_degree": QUADRATURE_DEGREE})
    residual = build(Terms(mesh, named[0], named[1], named[2], constants, dX))
    jacobian = ufl.derivative(residual, x, ufl.TrialFunction(space))

    def compiled(form: ufl.Form) -> Any:
        return fem.compile_form(comm, form, jit_options=JIT_OPTIONS)

    compiled_jacobian = compiled(jacobian)

    def on_one_cell(space: Any, value: Callable[[], float]) -> Any:
        functions = {c: fem.Function(space) for c in (x, star)}
        for function in functions.values():
            function.x.array[:] = [value() for _ in function.x.array]
        values = {c: fem.Constant(space.mesh, value()) for c in constants.values()}
        return fem.create_form(compiled_jacobian, [space, space], space.mesh, {}, functions, values)

    field_of_dof, coupled = _blocks(element, fields, on_one_cell)
    _COMPILED[kind] = CompiledPhase(
        kind, fields, element, compiled(residual), compiled_jacobian, field_of_dof, coupled, x, star, constants, build
    )
    return _COMPILED[kind]


def newtonian_liquid(comm: MPI.Comm, moving: bool) -> CompiledPhase:
    """Newtonian liquid with the fields u, p and, if the mesh moves, eta; collective."""

    def build(terms: Terms) -> ufl.Form:
        x, test, dX = terms.x, terms.test, terms.dX
        kin = Kinematics.of(terms.mesh, x.get("eta"))
        form = momentum(kin, newtonian.extra_stress(kin, x["u"], 1.0), x["p"], test["u"], dX)
        form += continuity.liquid(kin, x["u"], test["p"], dX)
        if "eta" in test:
            form += mesh_motion.elastic_extension(terms.mesh, x["eta"], test["eta"], dX)
        return form

    fields = (VELOCITY, PRESSURE, DISPLACEMENT) if moving else (VELOCITY, PRESSURE)
    return _compile(comm, ("newtonian", moving), fields, (), build)


def viscoelastic_liquid(comm: MPI.Comm, law: polymer.Name, moving: bool, steady: bool = False) -> CompiledPhase:
    """Viscoelastic liquid with the fields u, p, s = log c and, if the mesh moves, eta; collective.

    In time-dependent problems the velocity of the mesh follows from eta. In quasi-steady problems it is a field w, and
    the time derivative of s is multiplied by the constant `rate`: 0 in a quasi-steady solve, 1/dt in a step of
    pseudo-time.

    Args:
        comm: Communicator of the case.
        law: Constitutive law.
        moving: Whether the mesh moves.
        steady: Whether the problem is quasi-steady.
    """

    def build(terms: Terms) -> ufl.Form:
        x, star, test, k, dX = terms.x, terms.star, terms.test, terms.constants, terms.dX
        kin = Kinematics.of(terms.mesh, x.get("eta"))
        s = LogConformation.of(x["s"])
        solvent = newtonian.extra_stress(kin, x["u"], k["xi"])
        tau = constitutive.stress(law, s, k["xi"], k["De"], k["L2"])
        form = momentum(kin, (solvent[0] + tau[0], solvent[1] + tau[1]), x["p"], test["u"], dX)
        form += continuity.liquid(kin, x["u"], test["p"], dX)
        if "eta" in test:
            form += mesh_motion.elastic_extension(terms.mesh, x["eta"], test["eta"], dX)
        if steady:
            v, change = x["u"] - x["w"], (x["s"] - star["s"]) * k["rate"]
        else:
            v, change = x["u"], (x["s"] - star["s"]) / k["g"]
            if moving:
                v = v - ufl.as_vector([k["U_m"], 0]) - (x["eta"] - star["eta"]) / k["g"]
        rate = LogConformation.of(change + ufl.dot(kin.grad(x["s"]), v))
        relaxed = constitutive.relaxation(law, s, k["alpha"], k["epsilon"], k["L2"])
        strong = constitutive.residual(kin, s, (rate.block, rate.hoop), x["u"], relaxed, k["De"])
        time = constitutive.upwind_time(terms.mesh, v, k["De"], UPWIND_SCALE)
        return form + constitutive.constitutive(kin, strong, test["s"], v, time, dX)

    fields = [VELOCITY, PRESSURE, LOG_CONFORMATION]
    fields += [DISPLACEMENT] if moving else []
    fields += [MESH_VELOCITY] if steady else []
    names = ("De", "xi", "alpha", "epsilon", "L2", *(("rate",) if steady else ("g", "U_m")))
    return _compile(comm, (law, moving, steady), tuple(fields), names, build)


def neo_hookean_solid(comm: MPI.Comm) -> CompiledPhase:
    """Neo-Hookean solid with the fields eta and p and the constant Ca_e; collective."""

    def build(terms: Terms) -> ufl.Form:
        x, test, dX = terms.x, terms.test, terms.dX
        kin = Kinematics.of(terms.mesh, x["eta"])
        stress = neo_hookean.extra_stress(kin, terms.constants["Ca_e"])
        return momentum(kin, stress, x["p"], test["eta"], dX) + continuity.solid(kin, test["p"], dX)

    return _compile(comm, ("neo-hookean",), (DISPLACEMENT, PRESSURE), ("Ca_e",), build)


class Phase:
    """A phase on its mesh, distributed over the processes of a communicator.

    Args:
        comm: Communicator of the case.
        compiled: Forms and fields.
        mesh: The mesh, identical on every process.
        constants: Values of the constants of the forms.

    Attributes:
        size: Number of canonical degrees of freedom.
        canonical: Canonical number of each local degree of freedom, owned ones before ghosts.
        owned: Number of local degrees of freedom that this process owns.
    """

    def __init__(
        self, comm: MPI.Comm, compiled: CompiledPhase, mesh: SixNodeMesh, constants: dict[str, float] | None = None
    ) -> None:
        self.comm, self.compiled, self.six_node_mesh = comm, compiled, mesh
        coordinate = basix.ufl.element("Lagrange", "triangle", 2, shape=(2,))
        cells = mesh.cells[:, TO_BASIX] if comm.rank == 0 else np.empty((0, 6), dtype=np.int64)
        points = mesh.points if comm.rank == 0 else np.empty((0, 2))
        self.mesh = dolfinx.mesh.create_mesh(comm, cells, coordinate, points)
        self.space = fem.functionspace(self.mesh, compiled.element)
        self.x, self.star = fem.Function(self.space), fem.Function(self.space)
        self.offsets = self._offsets()
        self.canonical = self._number()
        self.owned = int(self.space.dofmap.index_map.size_local * self.space.dofmap.index_map_bs)
        self.constants = {k: fem.Constant(self.mesh, float(v)) for k, v in (constants or {}).items()}
        constant_map = {compiled.constants[k]: self.constants[k] for k in self.constants}

        functions = {compiled.x: self.x, compiled.star: self.star}

        def create(form: Any, spaces: int) -> Any:
            return fem.create_form(form, [self.space] * spaces, self.mesh, {}, functions, constant_map)

        self._residual = create(compiled.residual, 1)
        self._jacobian = create(compiled.jacobian, 2)
        self._vector = np.zeros(len(self.x.x.array))

    def _offsets(self) -> dict[str, int]:
        nodes, vertices = len(self.six_node_mesh.points), len(self.six_node_mesh.vertices)
        offsets, total = {}, 0
        for f in self.compiled.fields:
            offsets[f.name] = total
            total += f.components * (nodes if f.degree == 2 else vertices)
        self.size = total
        return offsets

    def carriers(self, name: str) -> Indices:
        """Nodes at which a field has degrees of freedom: all nodes (P2) or the vertices (P1)."""
        f = next(f for f in self.compiled.fields if f.name == name)
        return np.arange(len(self.six_node_mesh.points)) if f.degree == 2 else self.six_node_mesh.vertices

    def index(self, name: str, nodes: Indices, component: int = 0) -> Indices:
        """Canonical numbers of a component of a field at given nodes, which must be vertices for a P1 field."""
        f = next(f for f in self.compiled.fields if f.name == name)
        if f.degree == 2:
            return np.asarray(self.offsets[name] + f.components * nodes + component)
        return np.asarray(
            self.offsets[name] + f.components * np.searchsorted(self.six_node_mesh.vertices, nodes) + component
        )

    @property
    def nodes(self) -> Indices:
        """Node of each canonical degree of freedom, shape (size,)."""
        return np.concatenate([np.repeat(self.carriers(f.name), f.components) for f in self.compiled.fields])

    def _number(self) -> Indices:
        node = self.mesh.geometry.input_global_indices[self.mesh.geometry.dofmap]
        canonical = np.full(len(self.x.x.array), -1, dtype=np.int64)
        for i, f in enumerate(self.compiled.fields):
            for c, part in enumerate(components(self.space, i, f)):
                dofs = part.dofmap.list
                canonical[dofs] = self.index(f.name, node[:, : dofs.shape[1]], c)
        return canonical

    def nodal(self, name: str, values: Array) -> Array:
        """Nodal values of a P2 field in a canonical vector, shape (nodes, components)."""
        f = next(f for f in self.compiled.fields if f.name == name)
        start = self.offsets[name]
        return values[start : start + f.components * len(self.six_node_mesh.points)].reshape(-1, f.components)

    def set(self, values: Array) -> None:
        """Set the unknowns on this process from a canonical vector, shape (size,)."""
        self.x.x.array[:] = values[self.canonical]

    def set_star(self, values: Array) -> None:
        """Set the part fixed by the time scheme from a canonical vector, shape (size,)."""
        self.star.x.array[:] = values[self.canonical]

    def residual(self) -> Array:
        """Contribution of this process to the residual, as a canonical vector, shape (size,)."""
        self._vector[:] = 0.0
        fem.assemble_vector(self._vector, self._residual)
        out = np.zeros(self.size)
        out[self.canonical] = self._vector
        return out

    def cell_jacobian(self) -> CellJacobian:
        """The Jacobian on the cells of this process, at the state of the phase when it is evaluated."""
        cells = self.mesh.topology.index_map(2).size_local
        dofs = self.canonical[self.space.dofmap.list[:cells]].astype(np.int32)
        local = self.compiled.field_of_dof
        coupled = self.compiled.coupled[np.ix_(local, local)]
        form, ffi = self.compiled.jacobian.ufcx_form, self.compiled.jacobian.module.ffi
        kernel = form.form_integrals[0].tabulate_tensor_float64
        return CellJacobian(
            ctypes.c_void_p(int(ffi.cast("uintptr_t", kernel))),
            dofs,
            np.concatenate([[0], np.cumsum(coupled.sum(axis=1))]).astype(np.int32),
            np.nonzero(coupled)[1].astype(np.int32),
            self.mesh.geometry.x,
            self.mesh.geometry.dofmap[:cells],
            self._packed,
        )

    def _packed(self) -> tuple[Array, int, Array]:
        (coefficients,) = fem.pack_coefficients(self._jacobian).values()
        return coefficients, coefficients.shape[1], fem.pack_constants(self._jacobian)

"""Weights of a scene one degree above the space of its test functions, and the residual tested with them.

The weight of a functional is recovered on the mesh of each phase, and what is left of it when the discrete one is taken
away is the test function of the residual. It is zero where the exact solution meets a condition that the discrete one
meets too: u on wall, ends and rigid surfaces, s on the ends. On the surface of a soft particle liquid and solid have
one test function (their momentum equations are added there), which is that of the solid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.fem.enriched_residual import EnrichedResidual, nodes_of
from pairsim.fem.patch_recovery import PatchRecovery
from pairsim.fem.phases import Phase
from pairsim.fem.scene import Body, Scene
from pairsim.fem.six_node_mesh import MIDSIDE_OPPOSITE, shape_values
from pairsim.runtime.arrays import Array, Indices

# Fewest nodes of a patch by degree of the recovered field: two rings of cells inside the mesh. Fewer nodes (9 and 15)
# gave estimates of .3 to .9 of the errors of Newtonian pairs, a third ring at boundaries (18 and 40) 1.1 to 1.9 where
# two rings gave 1.05 to 1.4.
WIDE = {2: 14, 3: 25}
# That of a second recovery of quadratic fields, the pressures, mostly from one ring. Where both differ, neither is near
# the adjoint: on coarse cells in viscoelastic liquids the difference is as large as the estimate.
NARROW = {2: 9}


@dataclass(frozen=True)
class TestedResidual:
    """A residual tested with the recovered weights of k functionals.

    Attributes:
        sums: The residuals, (k,).
        changes: By how much another recovery of the pressures' weights changes them, (k,).
        stress_products: Sums over the cells of the products of what two functionals have of the constitutive equation
            there, (k, k). Where the weight of the stress is not resolved its contributions have random signs, and the
            root of a functional's sum of squares is the size of error to expect of their sum.
        stress_by_cell: These contributions themselves in the cells of this process, (k, m); None in a Newtonian liquid.
    """

    sums: Array
    changes: Array
    stress_products: Array
    stress_by_cell: Array | None


class Enrichment:
    """Recoveries and enriched residuals of all phases of a scene.

    Args:
        scene: The scene.
        before: Those of the same particles in a liquid of another mesh: soft particles keep theirs.
    """

    def __init__(self, scene: Scene, before: Enrichment | None = None) -> None:
        self.scene = scene
        self._phases: list[_EnrichedPhase]
        kept = {id(enriched.phase): enriched for enriched in (before._phases if before else ())}
        self._phases = [kept.get(id(phase)) or _EnrichedPhase(phase) for phase in scene.phases]

    def tested(self, weights: Array) -> TestedResidual:
        """The residual at the phases' present unknowns, tested with what the recovery adds to weights.

        Args:
            weights: Test functions as full vectors, (k, n).
        """
        scene = self.scene
        sums = np.zeros((2, len(weights)))
        surfaces: list[Array | None] = []
        solids = iter(self._phases[1:])
        for body in scene.bodies:
            surfaces.append(None)
            if body.phase is not None:
                solid, start = next(solids), scene.offset(body.phase)
                own = weights[:, start : start + body.phase.size]
                recovered = solid.recover(own)
                sums += solid.tested(solid.residual.assemble(), solid.additions(recovered), solid.narrow_additions(own))
                surfaces[-1] = solid.on_outline(recovered, body)
        liquid = self._phases[0]
        own = weights[:, : scene.liquid.size]
        additions = liquid.additions(liquid.recover(own))
        self._constrain(liquid, additions, surfaces)
        residual = liquid.residual.assemble()
        sums += liquid.tested(residual, additions, liquid.narrow_additions(own))
        products, by_cell = np.zeros((len(weights), len(weights))), None
        if "s" in residual:
            by_cell = np.einsum("kmqc,mqc->km", additions["s"], residual["s"])
            products = by_cell @ by_cell.T
        return TestedResidual(sums[0], sums[1], products, by_cell)

    def corners(self) -> Array:
        """Vertices of the cells of the liquid in the reference domain, (m, 3, 2)."""
        liquid = self._phases[0]
        return np.asarray(liquid.phase.six_node_mesh.points[liquid.residual.cells[:, :3]])

    def _constrain(self, liquid: _EnrichedPhase, additions: dict[str, Array], surfaces: list[Array | None]) -> None:
        """Put the boundary conditions of the liquid into its additions."""
        nodes = self.scene.nodes
        for group in (nodes.wall, nodes.inlet, nodes.outlet):
            additions["u"][:, liquid.nodes_on(group, "u")] = 0.0
        if "s" in additions:
            for group in (nodes.inlet, nodes.outlet):
                additions["s"][:, liquid.nodes_on(group, "s")] = 0.0
        for at, surface in zip(nodes.interfaces, surfaces, strict=True):
            on = liquid.nodes_on(at, "u")
            additions["u"][:, on] = 0.0 if surface is None else surface[:, liquid.outline_index(at, on, "u")]


class _EnrichedPhase:
    """One phase: recovery of its weights, and its enriched residual.

    Recovered weights are polynomials around all vertices by field, with the fields' nodal values.
    """

    def __init__(self, phase: Phase) -> None:
        self.phase, self.residual = phase, EnrichedResidual(phase)
        mesh = phase.six_node_mesh
        self._fields = {f.name: f for f in self.residual.fields}
        degrees = {f.degree for f in self.residual.fields}
        self._wide = {degree: PatchRecovery(mesh, degree, fewest) for degree, fewest in WIDE.items()}
        self._narrow = {degree: PatchRecovery(mesh, degree, fewest) for degree, fewest in NARROW.items()}
        self._points = {degree: nodes_of(degree) for degree in degrees}
        cell_points = mesh.points[self.residual.cells]
        self._positions = {
            degree: np.einsum("qa,mak->mqk", shape_values(points), cell_points, optimize=True)
            for degree, points in self._points.items()
        }

    def recover(self, weights: Array) -> dict[str, tuple[Array, Array]]:
        """Nodal values (n_nodes, k, components) and polynomials by field of weights (k, size)."""
        return self._recover(weights, self._wide)

    def _recover(self, weights: Array, recoveries: dict[int, PatchRecovery]) -> dict[str, tuple[Array, Array]]:
        phase = self.phase
        recovered = {}
        for f in self.residual.fields:
            if f.degree not in recoveries:
                continue
            values = np.zeros((len(phase.six_node_mesh.points), len(weights), f.components))
            nodes, recovery = phase.carriers(f.name), recoveries[f.degree]
            coefficients = []
            for c in range(f.components):
                values[nodes, :, c] = weights[:, phase.index(f.name, nodes, c)].T
                coefficients.append(recovery.coefficients(values[:, :, c], c in f.odd))
            recovered[f.name] = values, np.stack(coefficients, axis=-1)
        return recovered

    def additions(self, recovered: dict[str, tuple[Array, Array]]) -> dict[str, Array]:
        """Recovered minus own weights at the nodes of the test functions, (k, m, n, components)."""
        return self._additions(recovered, self._wide)

    def narrow_additions(self, weights: Array) -> dict[str, Array]:
        """Those of the second recovery of weights (k, size), for the fields that it is there for."""
        return self._additions(self._recover(weights, self._narrow), self._narrow)

    def _additions(
        self, recovered: dict[str, tuple[Array, Array]], recoveries: dict[int, PatchRecovery]
    ) -> dict[str, Array]:
        cells = self.residual.cells
        result = {}
        for name, (values, coefficients) in recovered.items():
            f = self._fields[name]
            points, recovery = self._points[f.degree], recoveries[f.degree]
            barycentric = _barycentric(points)
            shapes = shape_values(points) if f.degree == 3 else barycentric
            own = np.einsum("qa,makc->kmqc", shapes, values[cells[:, : shapes.shape[1]]], optimize=True)
            flat = coefficients.reshape(*coefficients.shape[:2], -1)
            plus = recovery.blended(flat, cells[:, :3], barycentric, self._positions[f.degree])
            plus = np.moveaxis(plus.reshape(*plus.shape[:2], *coefficients.shape[2:]), 2, 0)
            result[name] = plus - own
        return result

    def tested(self, residual: dict[str, Array], additions: dict[str, Array], others: dict[str, Array]) -> Array:
        """This process's part of the residual tested with additions, and its change with others instead, (2, k)."""
        one = {name: np.einsum("kmqc,mqc->k", each, residual[name]) for name, each in additions.items()}
        two = [np.einsum("kmqc,mqc->k", each, residual[name]) - one[name] for name, each in others.items()]
        return np.array([sum(one.values()), sum(two)])

    def on_outline(self, recovered: dict[str, tuple[Array, Array]], body: Body) -> Array:
        """Additions to the displacement's weights of a soft particle along its outline, (k, q, components).

        The points are those of the test functions on the edges, from the downstream pole on, vertices included.
        """
        f = self._fields["eta"]
        values, coefficients = recovered["eta"]
        t = _edge_parameters(self._points[f.degree])
        ends = np.column_stack([body.nodes[:-2:2], body.nodes[2::2]])
        shapes = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=1)
        arcs = np.stack([body.nodes[:-2:2], body.nodes[1::2], body.nodes[2::2]], axis=1)
        x = np.einsum("qa,mak->mqk", shapes, self.phase.six_node_mesh.points[arcs])
        flat = coefficients.reshape(*coefficients.shape[:2], -1)
        plus = self._wide[f.degree].blended(flat, ends, np.column_stack([1 - t, t]), x)
        own = np.einsum("qa,makc->mqkc", shapes, values[arcs])
        added = plus.reshape(own.shape) - own
        every = np.concatenate([added[:, :-1].reshape(-1, *added.shape[2:]), added[-1, -1:]])
        return np.moveaxis(every, 1, 0)

    def nodes_on(self, nodes: Indices, field: str) -> np.ndarray:
        """Which nodes of a field's test functions lie on the line of given nodes, (m, n) of bool."""
        on = np.zeros(len(self.phase.six_node_mesh.points), dtype=bool)
        on[nodes] = True
        marked, barycentric = on[self.residual.cells], _barycentric(self._points[self._fields[field].degree])
        result = np.zeros((len(marked), len(barycentric)), dtype=bool)
        for q, each in enumerate(barycentric):
            absent = np.flatnonzero(each < 1e-12)
            if len(absent) == 2:
                result[:, q] = marked[:, np.argmax(each)]
            elif len(absent) == 1:
                result[:, q] = marked[:, MIDSIDE_OPPOSITE[absent[0]]]
        return result

    def outline_index(self, outline: Indices, on: np.ndarray, field: str) -> Indices:
        """Numbers, in the order of `on_outline`, of the nodes of test functions that lie on an outline."""
        number = np.zeros(len(self.phase.six_node_mesh.points))
        number[outline] = np.arange(len(outline))
        points = self._points[self._fields[field].degree]
        t = _edge_parameters(points)
        along = (number[self.residual.cells[:, :3]] @ _barycentric(points).T)[on] / 2
        arc = np.minimum(np.floor(along + 1e-9), len(outline) // 2 - 1)
        place = np.abs((along - arc)[:, None] - t).argmin(axis=1)
        return np.asarray(arc * (len(t) - 1) + place, dtype=np.int64)


def _barycentric(points: Array) -> Array:
    """Barycentric coordinates of points of the reference triangle, (n, 3)."""
    return np.column_stack([1 - points.sum(axis=1), points])


def _edge_parameters(points: Array) -> Array:
    """Where nodes of test functions lie along an edge, ends included, ascending from 0 to 1."""
    return np.sort(points[np.abs(points[:, 1]) < 1e-12, 0])

"""The residual of a scene tested with weights one degree above the space of its test functions.

The adjoint of a functional is recovered on the mesh of each phase, and the residual is tested with the difference
between the recovered and the discrete adjoint, the weight z+ - z_h. The weight is zero where exact and discrete
solution satisfy the same boundary condition: for u on wall, ends and rigid surfaces, for transported fields on the
ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.fem.recovery.enriched_residual import EnrichedTests
from pairsim.fem.recovery.enriched_scene import EnrichedPhase, EnrichedScene
from pairsim.fem.recovery.patch_recovery import NARROW
from pairsim.fem.recovery.viscosity_scatter import viscosity_scatter
from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class WeightedResidual:
    """A residual tested with the weights of k functionals.

    Attributes:
        sums: The tested residuals R(x_h; z+ - z_h), (k,); estimates of errors are minus these.
        in_liquid: The part of `sums` that comes from the liquid, (k,); the rest comes from the particles.
        changes: Changes of `sums` if the weights of the pressures are recovered from narrower patches, (k,).
        stress_products: Gram matrix of the cell indicators, sum_K q_iK q_jK over the cells K of the liquid, (k, k).
            Where the weight of the stress is not resolved, indicators have random signs, and the root of a diagonal
            entry is the size to expect of the sum of a functional's indicators.
        stress_by_cell: The cell indicators q_iK, (k, m): contributions of the constitutive equations of modes and
            scalars to `sums`; in a liquid without a memory those of `viscosity_scatter`; None in a Newtonian liquid.
        corners: Vertices of the cells of the liquid in the reference domain, (m, 3, 2).
    """

    sums: Array
    in_liquid: Array
    changes: Array
    stress_products: Array
    stress_by_cell: Array | None
    corners: Array

    @staticmethod
    def of(enriched: EnrichedScene[EnrichedTests], x: Array, weights: Array) -> WeightedResidual:
        """Test the residual with what the recovery adds to discrete adjoints.

        Args:
            enriched: The scene, whose phases are set to the unknowns x.
            x: The unknowns at which the residual is evaluated, as a full vector, (n,).
            weights: Discrete adjoints z_h as full vectors, (k, n).
        """
        own = enriched.parts(weights)
        added = [phase.added(w, phase.residual.fields) for phase, w in zip(enriched.phases, own, strict=True)]
        enriched.join(added[0]["u"], (each["eta"] for each in added[1:]))
        for at in (enriched.wall, enriched.inlet, enriched.outlet):
            added[0]["u"][at] = 0.0
        transported = [f.name for f in enriched.scene.material.transported]
        for at in (enriched.inlet, enriched.outlet):
            for name in transported:
                added[0][name][at] = 0.0
        sums, changes, stress = list[Array](), np.zeros(len(weights)), None
        for phase, w, additions in zip(enriched.phases, own, added, strict=True):
            residual = phase.residual.assemble()
            tested = _by_cell(phase, residual, additions)
            others = _by_cell(phase, residual, phase.added(w, phase.residual.fields, NARROW))
            sums.append(np.sum([each.sum(axis=1) for each in tested.values()], axis=0))
            changes += sum(each.sum(axis=1) - tested[name].sum(axis=1) for name, each in others.items())
            if phase is enriched.liquid and transported:
                stress = np.sum([tested[name] for name in transported], axis=0)
        mesh, order = enriched.liquid.phase.six_node_mesh, enriched.liquid.residual.cells
        if stress is None and not enriched.scene.material.newtonian:
            stress = viscosity_scatter(enriched, x, weights)[:, order]
        products = np.zeros((len(weights), len(weights))) if stress is None else stress @ stress.T
        corners = mesh.points[mesh.cells[order, :3]]
        return WeightedResidual(np.sum(sums, axis=0), sums[0], changes, products, stress, corners)


def _by_cell(
    phase: EnrichedPhase[EnrichedTests], residual: dict[str, Array], weights: dict[str, Array]
) -> dict[str, Array]:
    """Contribution of each cell to the residual tested with weights, by field, (k, m)."""
    return {
        name: np.einsum("mqkc,mqc->km", phase.in_cells(name, values), residual[name], optimize=True)
        for name, values in weights.items()
    }

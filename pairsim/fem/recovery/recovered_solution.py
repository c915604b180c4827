"""The solution of a scene in time recovered one degree higher, and the residual with it.

Recovered fields keep the nodal values of the discrete ones: only what lies outside the discrete space is added, so that
nothing depends on how far recovery smooths nodal values. They satisfy the boundary conditions of the exact solution: u
is zero on the wall, the velocity of the particle on a rigid surface, and that of the material on a soft one, where the
liquid's mesh follows the material. Elsewhere the mesh of the liquid is that of the discrete solution.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.fem.body import Body
from pairsim.fem.recovery.enriched_nodes import remainder
from pairsim.fem.recovery.enriched_residual import Additions, EnrichedUnknowns, physical
from pairsim.fem.recovery.enriched_scene import EnrichedPhase, EnrichedScene
from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class RecoveredSolution:
    """What recovery adds to a solution, for each phase.

    Attributes:
        enriched: The scene.
        added: Additions to the unknowns.
        star_added: Additions to the part that the time scheme fixes.
    """

    enriched: EnrichedScene[EnrichedUnknowns]
    added: list[Additions]
    star_added: list[Additions]

    @staticmethod
    def of(
        enriched: EnrichedScene[EnrichedUnknowns], x: Array, star: Array | None, velocity: Array
    ) -> RecoveredSolution:
        """Recover a solution.

        Args:
            enriched: The scene.
            x: Full vector, shape (n,).
            star: The part that the time scheme fixes, shape (n,); None where no stress depends on rates.
            velocity: Velocity of the material, shape (n_h,).
        """
        scene, liquid, solids = enriched.scene, enriched.liquid, enriched.solids
        own, *inside = enriched.parts(x[None])
        added = liquid.added(own, _names(liquid))
        added["u"][enriched.wall] = 0.0
        soft = [body for body in scene.bodies if body.phase is not None]
        moving = [s.added(_as_displacement(b, velocity)[None], ["eta"]) for s, b in zip(solids, soft, strict=True)]
        enriched.join(added["u"], (each["eta"] for each in moving))
        within = [s.added(x, _names(s)) for s, x in zip(solids, inside, strict=True)]
        fixed, before = dict[str, Array](), [dict[str, Array]() for _ in solids]
        if star is not None:
            own, *inside = enriched.parts(star[None])
            fixed = liquid.added(own, [f.name for f in scene.material.transported])
            before = [s.added(x, ["eta"]) for s, x in zip(solids, inside, strict=True)]
        if scene.moving:
            for values, of_solids in ((added, within), (fixed, before))[: 1 if star is None else 2]:
                values["eta"] = np.zeros((liquid.nodes[3].count, 1, 2))
                enriched.join(values["eta"], (each["eta"] for each in of_solids))
        phases = enriched.phases
        return RecoveredSolution(
            enriched,
            [_beyond(*each) for each in zip(phases, [added, *within], strict=True)],
            [_beyond(*each) for each in zip(phases, [fixed, *before], strict=True)],
        )

    def residuals(self, x: Array, star: Array | None) -> list[Array]:
        """The residual of each phase at x and star with the additions, as canonical vectors.

        Args:
            x: Full vector, shape (n,).
            star: The part that the time scheme fixes, shape (n,); None where no stress depends on rates.
        """
        phases, own = self.enriched.phases, self.enriched.parts(x)
        fixed = [None for _ in phases] if star is None else self.enriched.parts(star)
        return [
            each.residual.assemble(x, added, star if each.phase.compiled.timed else None, star_added)
            for each, x, added, star, star_added in zip(phases, own, self.added, fixed, self.star_added, strict=True)
        ]


def _names(phase: EnrichedPhase[EnrichedUnknowns]) -> list[str]:
    """Names of the fields that are recovered."""
    return [f.name for f in physical(phase.residual.fields.values())]


def _beyond(phase: EnrichedPhase[EnrichedUnknowns], added: dict[str, Array]) -> Additions:
    """The part of the additions that lies outside the fields' own space, at the nodes of each cell."""
    result = {}
    for name, values in added.items():
        there, part = phase.in_cells(name, values[:, 0]), remainder(phase.residual.fields[name].degree)
        result[name] = np.stack([there[..., c] @ part.T for c in range(there.shape[-1])], axis=-1)
    return result


def _as_displacement(body: Body, velocity: Array) -> Array:
    """Canonical vector of a soft particle with a velocity of its material as displacement and zeros elsewhere."""
    assert body.phase is not None
    result = np.zeros(body.phase.size)
    body.phase.nodal("eta", result)[:] = body.displacement(velocity)
    return result

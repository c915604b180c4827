"""Fields of all phases of a scene recovered one degree higher, with the boundary conditions of the exact fields.

On the surface of a soft particle liquid and solid share velocity, displacement and test functions, as their momentum
equations are added there. Those of the solid are taken.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise

import numpy as np

from pairsim.fem.phases.phase import Phase
from pairsim.fem.recovery.enriched_nodes import EnrichedNodes
from pairsim.fem.recovery.enriched_residual import EnrichedResidual
from pairsim.fem.recovery.patch_recovery import WIDE, PatchRecovery
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array, Indices


class EnrichedPhase[R: EnrichedResidual]:
    """A phase: recovery of its fields, and its residual one degree higher.

    Args:
        phase: The phase.
        residual: Makes the residual of a phase.
    """

    def __init__(self, phase: Phase, residual: Callable[[Phase], R]) -> None:
        self.phase, self.residual = phase, residual(phase)
        self.nodes = {degree: EnrichedNodes(phase.six_node_mesh, degree) for degree in WIDE}
        self._recoveries: dict[tuple[int, int], PatchRecovery] = {}

    def along(self, line: Indices) -> Indices:
        """Numbers of the nodes of third degree along a line of nodes of the mesh."""
        return self.nodes[3].along(line)

    def added(self, vectors: Array, names: Iterable[str], fewest: dict[int, int] = WIDE) -> dict[str, Array]:
        """What recovery adds to fields at all nodes of one degree higher, by name, (n, k, components).

        Args:
            vectors: Canonical vectors, (k, size).
            names: Names of the fields.
            fewest: Fewest nodes of a patch, by degree of the recovered field; fields of other degrees are left out.
        """
        result = {}
        for name in names:
            f, carriers = self.residual.fields[name], self.phase.carriers(name)
            if f.degree not in fewest:
                continue
            recovery, parts = self._recovery(f.degree, fewest[f.degree]), []
            for c in range(f.components):
                nodal = np.zeros((len(self.phase.six_node_mesh.points), len(vectors)))
                nodal[carriers] = vectors[:, self.phase.index(name, carriers, c)].T
                parts.append(recovery.added(nodal, c in f.odd))
            result[name] = np.stack(parts, axis=-1)
        return result

    def in_cells(self, name: str, values: Array) -> Array:
        """Values of a field at all nodes, (n, ...), at the nodes of each cell of the residual, (m, q, ...)."""
        return np.asarray(values[self.nodes[self.residual.fields[name].degree].numbers[self.residual.cells]])

    def _recovery(self, degree: int, fewest: int) -> PatchRecovery:
        if (degree, fewest) not in self._recoveries:
            self._recoveries[degree, fewest] = PatchRecovery(self.nodes[degree], fewest)
        return self._recoveries[degree, fewest]


class EnrichedScene[R: EnrichedResidual]:
    """The phases of a scene, the liquid first.

    Args:
        scene: The scene.
        residual: Makes the residual of a phase.
        before: The same particles in a liquid with another mesh: what belongs to the soft particles is reused.

    Attributes:
        liquid: The liquid.
        solids: The soft particles.
        wall, inlet, outlet: Numbers of the liquid's nodes of third degree on these boundaries.
    """

    def __init__(self, scene: Scene, residual: Callable[[Phase], R], before: EnrichedScene[R] | None = None) -> None:
        self.scene, nodes, points = scene, scene.nodes, scene.liquid.six_node_mesh.points
        kept = {id(each.phase): each for each in (before.phases if before else ())}
        self.liquid, *self.solids = (kept.get(id(phase)) or EnrichedPhase(phase, residual) for phase in scene.phases)
        self.wall = self.liquid.along(nodes.wall[np.argsort(points[nodes.wall, 0])])
        self.inlet, self.outlet = self.liquid.along(nodes.inlet), self.liquid.along(nodes.outlet)
        self._surfaces = [self.liquid.along(at) for at in nodes.interfaces]

    @property
    def phases(self) -> list[EnrichedPhase[R]]:
        """All phases, in the order of those of the scene."""
        return [self.liquid, *self.solids]

    def parts(self, vectors: Array) -> list[Array]:
        """The canonical vectors of the phases in full vectors, (..., n)."""
        return [vectors[..., a:b] for a, b in pairwise(self.scene.offsets)]

    def join(self, liquid: Array, solids: Iterable[Array]) -> None:
        """Set a field of the liquid on the particles' surfaces: to zero on rigid ones, to that of the solid on others.

        Args:
            liquid: Values at the liquid's nodes of third degree, (n, k, components); changed in place.
            solids: Values at those of each soft particle.
        """
        own = iter(zip(self.solids, solids, strict=True))
        for body, at in zip(self.scene.bodies, self._surfaces, strict=True):
            liquid[at] = 0.0
            if body.phase is not None:
                solid, values = next(own)
                liquid[at] = values[solid.along(body.nodes)]

"""A scene in time at its solution recovered one degree higher.

Recovered fields keep the nodal values of the discrete ones: only what the discrete space does not hold is added, so
that nothing depends on how far recovery smooths nodal values. They meet the conditions that the exact solution meets: u
is zero on the wall, the velocity of the particle on a rigid surface, and that of the material on a soft one, where the
liquid's mesh follows the material. Elsewhere the mesh of the liquid is that of the discrete solution.
"""

from __future__ import annotations

from functools import cache

import basix
import numpy as np

from pairsim.fem.enriched_nodes import EnrichedNodes, own_shapes
from pairsim.fem.enriched_residual import UNPHYSICAL
from pairsim.fem.enrichment import WIDE
from pairsim.fem.phases import Phase
from pairsim.fem.recovered_residual import Additions, RecoveredResidual
from pairsim.fem.scene import Body, Scene
from pairsim.runtime.arrays import Array, Indices

Nodal = dict[str, list[Array]]
"""What is added to each component of a field, by field: values at all nodes of one degree higher, (n,)."""


class RecoveredScene:
    """Additions to a scene's solution, and the residual with them.

    Args:
        scene: The scene, time-dependent.
        before: That of the same particles in a liquid of another mesh: soft particles keep theirs.
    """

    def __init__(self, scene: Scene, before: RecoveredScene | None = None) -> None:
        self.scene = scene
        self._phases: list[_RecoveredPhase]
        kept = {id(each.phase): each for each in (before._phases if before else ())}
        self._phases = [kept.get(id(phase)) or _RecoveredPhase(phase) for phase in scene.phases]
        liquid, points = self._phases[0], scene.liquid.six_node_mesh.points
        self._wall = liquid.along(scene.nodes.wall[np.argsort(points[scene.nodes.wall, 0])])
        self._interfaces = [liquid.along(nodes) for nodes in scene.nodes.interfaces]
        self._added: list[Additions] = []
        self._star_added: list[Additions] = []

    def recover(self, x: Array, star: Array | None, velocity: Array) -> None:
        """Find what recovery adds to a solution.

        Args:
            x: Full vector, shape (n,).
            star: The part that the time scheme fixes, shape (n,); None where no stress depends on rates.
            velocity: Velocity of the material, shape (n_h,).
        """
        scene, liquid = self.scene, self._phases[0]
        added = liquid.added(x, liquid.recovered)
        fixed = liquid.added(star, [name for name in liquid.recovered if name == "s"]) if star is not None else {}
        self._added, self._star_added = [], []
        for values in added["u"]:
            values[self._wall] = 0.0
        if scene.moving:
            added["eta"] = [np.zeros(liquid.count) for _ in range(2)]
            fixed |= {"eta": [np.zeros(liquid.count) for _ in range(2)]} if star is not None else {}
        solids = iter(self._phases[1:])
        for body, at in zip(scene.bodies, self._interfaces, strict=True):
            if body.phase is None:
                for values in added["u"]:
                    values[at] = 0.0
                continue
            solid = next(solids)
            own, line = x[scene.offset(body.phase) :], solid.along(body.nodes)
            inside = solid.added(own, solid.recovered)
            moving = solid.added(_as_displacement(body, velocity), ["eta"])["eta"]
            for c in range(2):
                added["u"][c][at] = moving[c][line]
                added["eta"][c][at] = inside["eta"][c][line]
            if star is not None:
                before = solid.added(star[scene.offset(body.phase) :], ["eta"])["eta"]
                for c in range(2):
                    fixed["eta"][c][at] = before[c][line]
            self._added.append(solid.beyond(inside))
            self._star_added.append(solid.beyond({"eta": before}) if star is not None else {})
        self._added.insert(0, liquid.beyond(added))
        self._star_added.insert(0, liquid.beyond(fixed))

    def residuals(self, x: Array, star: Array | None) -> list[Array]:
        """This process's part of the residual of each phase at x and star with the additions, as canonical vectors.

        Args:
            x: Full vector, shape (n,).
            star: The part that the time scheme fixes, shape (n,); None where no stress depends on rates.
        """
        result, parts = [], zip(self._phases, self._added, self._star_added, self.scene.offsets[:-1], strict=True)
        for each, added, star_added, start in parts:
            part = slice(start, start + each.phase.size)
            own = star[part] if star is not None and each.phase.compiled.timed else None
            result.append(each.residual.assemble(x[part], added, own, star_added))
        return result


class _RecoveredPhase:
    """Recovery of one phase, and its residual with recovered unknowns.

    Attributes:
        recovered: Names of the fields that are recovered.
    """

    def __init__(self, phase: Phase) -> None:
        self.phase, self.residual = phase, RecoveredResidual(phase)
        fields = self.residual.fields
        untested = UNPHYSICAL["liquid" if "u" in fields else "solid"]
        self.recovered = [name for name in fields if name not in untested]
        self._nodes = {degree: EnrichedNodes(phase.six_node_mesh, degree, WIDE[degree]) for degree in (2, 3)}

    @property
    def count(self) -> int:
        """Number of nodes of third degree."""
        return self._nodes[3].count

    def along(self, line: Indices) -> Indices:
        """Numbers of the nodes of third degree along a line of nodes of the mesh."""
        return self._nodes[3].along(line)

    def added(self, values: Array, names: list[str]) -> Nodal:
        """Recovered minus own fields of a canonical vector, or of a longer one that begins with it."""
        phase = self.phase
        result: Nodal = {}
        nodal = np.zeros(len(phase.six_node_mesh.points))
        for name in names:
            f, carriers = self.residual.fields[name], phase.carriers(name)
            nodes, result[name] = self._nodes[f.degree], []
            for c in range(f.components):
                nodal[carriers] = values[phase.index(name, carriers, c)]
                result[name].append(nodes.added(nodal, c in f.odd))
        return result

    def beyond(self, added: Nodal) -> Additions:
        """The part of additions that the fields' own space does not hold, on this process's cells."""
        result = {}
        for name, values in added.items():
            degree = self.residual.fields[name].degree
            places, remainder = self._nodes[degree].numbers[self.residual.cells], _remainder(degree)
            result[name] = [each[places] @ remainder.T for each in values]
        return result


def _as_displacement(body: Body, velocity: Array) -> Array:
    """Canonical vector of a soft particle with the velocity of its material in the place of the displacement."""
    assert body.phase is not None
    result, values = np.zeros(body.phase.size), body.displacement(velocity)
    for c in range(2):
        result[body.phase.index("eta", np.arange(len(values)), c)] = values[:, c]
    return result


@cache
def _remainder(degree: int) -> Array:
    """Maps nodal values of a polynomial of a degree to those of what interpolation one degree lower leaves, (q, q)."""
    points = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])[: 6 if degree == 3 else 3]
    variant = basix.LagrangeVariant.gll_warped
    element = basix.create_element(basix.ElementFamily.P, basix.CellType.triangle, degree, variant)
    at_nodes = element.tabulate(0, points)[0, :, :, 0]
    own = own_shapes(degree)
    return np.asarray(np.eye(len(own)) - own @ at_nodes)

"""Start a case from the solutions of the one before it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.curves.adaptation import AdaptiveBranch
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.first_solution import first_scene, scene_past_end


class WarmStart:
    """Keeps the solvers of a case, so that the next case can start from its solutions."""

    def __init__(self) -> None:
        self._branch: AdaptiveBranch | None = None
        self._kind: tuple[Any, ...] = ()

    def start(
        self,
        problem: SteadyProblem,
        first: Parameters,
        places: Sequence[tuple[float, ...]],
        options: Mapping[str, Any],
    ) -> AdaptiveBranch | Ended:
        """A branch at the first point of a case, continued from the previous case if possible, else solved anew.

        Args:
            problem: The problem of the case.
            first: Parameters of its first point.
            places: Distances of the case.
            options: Other options of `AdaptiveBranch`.

        Returns:
            The branch, or what is known of its end before the first point.

        Raises:
            NoSteadyState: No solution was found that could be continued to the first point.
            MeshFailure: A mesh could not be generated.
        """
        laws = first.liquid.structure, [solid and solid.name for solid in first.solids]
        old, self._kind = self._kind, (problem, laws, dict(options))
        if self._branch is not None and self._kind == old:  # only distances and parameters of materials differ
            try:
                self._branch.restart(problem, first, places)
                return self._branch
            except NoSteadyState:
                pass
        self.close()
        scene = first_scene(problem, first)
        if isinstance(scene, Ended) and scene.kind and not first.gaps:
            scene = scene_past_end(problem, first, scene)
        if isinstance(scene, Ended):
            return scene
        self._branch = AdaptiveBranch(scene, places=places, **options)
        return self._branch

    def close(self) -> None:
        """Free the memory of the solvers; the next case is solved from undeformed spheres."""
        if self._branch is not None:
            self._branch.close()
        self._branch = None

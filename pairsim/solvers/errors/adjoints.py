"""Adjoint solutions of the goals of a quasi-steady scene.

The derivative of a result J(y) along any change dR of the residual is -z . dR, with the adjoint z of J. The adjoints of
all functionals are solved for at once; what moving adds, sensitivities, slopes and errors are products with them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.solvers.goals import GOALS, Functional, Goal, U
from pairsim.solvers.steady.linearisation import Linearisation


@dataclass(frozen=True)
class Adjoints:
    """Adjoints at a solution.

    Attributes:
        goals: What they are of, combined goals among them.
        functionals: The functionals of the goals that are not combined of others, in the order of `all`.
        all: The adjoints of all functionals, (K, n_y).
    """

    goals: tuple[Goal, ...]
    functionals: Mapping[Goal, Functional]
    all: Array

    @staticmethod
    def of(at: Linearisation, goals: Collection[Goal] = ()) -> Adjoints:
        """Solve for them at a solution.

        Args:
            at: The solution.
            goals: Goals beside those of `GOALS`.
        """
        return Adjoints.of_goals(at, dict.fromkeys([*GOALS, *goals]))

    @staticmethod
    def of_goals(at: Linearisation, goals: Collection[Goal]) -> Adjoints:
        """Solve for those of given goals alone."""
        solution = at.steady.solution
        functionals = {root: root.functional_at(solution) for root in dict.fromkeys(goal.root for goal in goals)}
        rows = np.vstack([each.rows for each in functionals.values()])
        return Adjoints(tuple(goals), functionals, at.adjoint(rows))

    def __iter__(self) -> Iterator[Goal]:
        return iter(self.goals)

    def __getitem__(self, goal: Goal) -> Array:
        """The adjoints of a goal, (k, n_y)."""
        own = self.all[self._part(goal.root)]
        return own if goal.parent is None else goal.combined(len(own)) @ own

    @property
    def velocities(self) -> Array:
        """The adjoints of the velocities of the particles, (N, n_y)."""
        return self[U]

    @property
    def apart(self) -> Array:
        """For each functional the length over which the pressure drop without particles is subtracted, (K,) [D_c]."""
        return np.concatenate([np.full(len(each.rows), each.apart) for each in self.functionals.values()])

    def combination(self, goal: Goal) -> Array:
        """The coefficients of a goal in the functionals, (k, K)."""
        part = self._part(goal.root)
        own = goal.combined(part.stop - part.start)
        return np.pad(own, ((0, 0), (part.start, len(self.all) - part.stop)))

    def change(self, goal: Goal, residual: Array) -> Array:
        """The change of a goal by a change of the residual (n_y,), (k,)."""
        own = -self.all[self._part(goal.root)] @ residual
        return np.asarray(goal.combined(len(own)) @ own)

    def _part(self, root: Goal) -> slice:
        """The functionals of a goal that is not combined."""
        start = 0
        for goal, functional in self.functionals.items():
            if goal == root:
                break
            start += len(functional.rows)
        return slice(start, start + len(self.functionals[root].rows))

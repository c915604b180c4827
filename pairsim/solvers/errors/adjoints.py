"""Adjoint solutions of the goals of a quasi-steady scene.

A change dR of the residual changes a result J(y) by -z . dR, to first order, with the adjoint z of J. The adjoints of
all functionals are solved for at once; the effect of motion, sensitivities, slopes and errors are products with them.
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
        goals: The goals, including those that are combinations of others.
        functionals: The functionals of the goals that are not such combinations, in the order of `all`.
        all: The adjoints of all functionals, (K, n_y).
    """

    goals: tuple[Goal, ...]
    functionals: Mapping[Goal, Functional]
    all: Array

    @staticmethod
    def of(at: Linearisation, goals: Collection[Goal] = ()) -> Adjoints:
        """Solve for the adjoints of all `GOALS`, and of other goals, at a solution.

        Args:
            at: The solution.
            goals: The other goals.
        """
        return Adjoints.of_goals(at, dict.fromkeys([*GOALS, *goals]))

    @staticmethod
    def of_goals(at: Linearisation, goals: Collection[Goal]) -> Adjoints:
        """Solve for the adjoints of given goals only."""
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
        """`Functional.apart` of each functional, (K,) [D_c]."""
        return np.concatenate([np.full(len(each.rows), each.apart) for each in self.functionals.values()])

    def combination(self, goal: Goal) -> Array:
        """Coefficients of the values of a goal as combinations of all functionals, (k, K)."""
        part = self._part(goal.root)
        own = goal.combined(part.stop - part.start)
        return np.pad(own, ((0, 0), (part.start, len(self.all) - part.stop)))

    def change(self, goal: Goal, residual: Array) -> Array:
        """The change of a goal's values, (k,), by a change of the residual, (n_y,), to first order."""
        own = -self.all[self._part(goal.root)] @ residual
        return np.asarray(goal.combined(len(own)) @ own)

    def _part(self, root: Goal) -> slice:
        """The place, among all functionals, of those of a goal that is not a combination."""
        start = 0
        for goal, functional in self.functionals.items():
            if goal == root:
                break
            start += len(functional.rows)
        return slice(start, start + len(self.functionals[root].rows))

"""The report in run.json on a branch of quasi-steady solutions, or on several branches in different processes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

from pairsim.record.run_entries import FACTORISATIONS, MESH_COUNT, NEWTON_ITERATIONS, SIZE, Entries, Entry
from pairsim.solvers.curves.adaptation import AdaptiveBranch, Place
from pairsim.solvers.goals import Goal

COUNTS = NEWTON_ITERATIONS, FACTORISATIONS, MESH_COUNT
"""Entries that are added up over several branches."""


@dataclass(frozen=True)
class BranchReport:
    """The report on a branch at its end: how its meshes were adapted, and what it has cost.

    Attributes:
        largest: Largest value known of each goal.
        rounds: Number of rounds of adaptation, by the place that meshes are made for, as in `AdaptiveBranch`.
        unknowns: Number of unknowns on the last mesh, by the same places.
        counts: Numbers that are added up over several branches.
        size: Largest number of unknowns.
        phases: Wall time of each phase [s].
    """

    largest: Mapping[Goal, float]
    rounds: Mapping[Place, int]
    unknowns: Mapping[Place, int]
    counts: Mapping[Entry[int], int]
    size: int
    phases: Mapping[str, float]

    @classmethod
    def of(cls, branch: AdaptiveBranch) -> Self:
        """The report of a branch."""
        solver = branch.solver
        counts = dict(zip(COUNTS, (solver.iterations, solver.factorisations, solver.meshes), strict=True))
        size = solver.constraints.size
        return cls(branch.largest, branch.rounds, branch.unknowns, counts, size, dict(solver.clock.seconds))

    def joined(self, other: BranchReport) -> BranchReport:
        """The report of this branch and of another one of the same case."""
        return BranchReport(
            {goal: max(size, other.largest.get(goal, 0.0)) for goal, size in self.largest.items()},
            {**other.rounds, **self.rounds},
            {**other.unknowns, **self.unknowns},
            {entry: count + other.counts[entry] for entry, count in self.counts.items()},
            max(self.size, other.size),
            {
                name: self.phases.get(name, 0.0) + other.phases.get(name, 0.0)
                for name in {**self.phases, **other.phases}
            },
        )

    @property
    def entries(self) -> Entries:
        """Its entries in run.json."""
        return {**self.counts, SIZE: self.size}

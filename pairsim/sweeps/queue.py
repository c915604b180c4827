"""The order of a sweep: which cases a shard does, and which of them a worker gets at once."""

from __future__ import annotations

import heapq
import json
import math
from collections import deque
from itertools import groupby, pairwise
from typing import Any

from pairsim.config.physical import BLOCK
from pairsim.sweeps.grid import SweepCase
from pairsim.sweeps.ledger import Shard
from pairsim.sweeps.worker import Task


def part_of(cases: tuple[SweepCase, ...], shard: Shard | None) -> list[SweepCase]:
    """The cases of a shard: the dearest first, each goes to the shard that has the least to do."""
    if shard is None:
        return list(cases)
    loads = [(0.0, i) for i in range(1, shard.n + 1)]
    owner = {}
    for case in sorted(cases, key=lambda case: -case.checked.estimate.seconds):
        load, i = heapq.heappop(loads)
        owner[case.folder] = i
        heapq.heappush(loads, (load + case.checked.estimate.seconds, i))
    return [case for case in cases if owner[case.folder] == shard.i]


def units(tasks: list[Task], neighbours: tuple[str, ...], workers: int) -> deque[list[Task]]:
    """What there is to do, the dearest first; the cases of a unit are computed in their order by one worker.

    Args:
        tasks: All of it.
        neighbours: Keys along which a case can start from another. Cases that differ in them alone make a sequence in
            which one key changes at a time; without keys every case is a unit.
        workers: How many there are. Chains are cut so that each worker gets two or more.
    """
    alike: dict[str, list[Task]] = {}
    for task in tasks:
        rest = {key: value for key, value in task.checked.identity.items() if key not in (*neighbours, BLOCK)}
        alike.setdefault(json.dumps(rest, sort_keys=True) if neighbours else task.key, []).append(task)
    longest = math.ceil(len(tasks) / (2 * workers))
    found = []
    for group in alike.values():
        sequence, pieces = _walk(group, neighbours), math.ceil(len(group) / longest)
        cuts = [i * len(sequence) // pieces for i in range(pieces + 1)]
        found += [sequence[a:b] for a, b in pairwise(cuts)]
    return deque(sorted(found, key=lambda unit: -sum(task.checked.estimate.seconds for task in unit)))


def _walk(group: list[Task], keys: tuple[str, ...]) -> list[Task]:
    """Through all values of the keys, back and forth, so that neighbours in the list are neighbours in the grid."""
    if not keys:
        return group

    def place(task: Task) -> tuple[Any, ...]:
        value = task.checked.identity[keys[0]]
        return tuple(value) if isinstance(value, list) else (value,)

    walked: list[Task] = []
    for i, (_, row) in enumerate(groupby(sorted(group, key=place), key=place)):
        rest = _walk(list(row), keys[1:])
        walked += rest[::-1] if i % 2 else rest
    return walked

"""The order of a sweep: the cases of each shard, and the groups of cases that one worker computes in sequence."""

from __future__ import annotations

import heapq
import json
import math
from collections import deque
from itertools import groupby, pairwise
from typing import Any

from pairsim.config.physical import BLOCK
from pairsim.sweeps.case import SweepCase
from pairsim.sweeps.options import Shard

# Largest number and estimated time [s] of cases that one process computes one after another. Chosen: the start of a
# process, one second, is then a small part of its time, and workers end a sweep within a minute of each other.
MOST_CASES, MOST_SECONDS = 50, 60.0


def part_of(cases: tuple[SweepCase, ...], shard: Shard | None) -> list[SweepCase]:
    """The cases of a shard: each case, the most expensive first, goes to the shard with the least load so far."""
    return list(cases) if shard is None else shards(cases, shard.n)[shard.i - 1]


def shards(cases: tuple[SweepCase, ...], count: int) -> list[list[SweepCase]]:
    """The cases of each of so many shards, in their order."""
    loads = [(0.0, i) for i in range(count)]
    parts: list[list[int]] = [[] for _ in range(count)]
    for k, case in sorted(enumerate(cases), key=lambda each: -each[1].estimate.seconds):
        load, i = loads[0]
        heapq.heapreplace(loads, (load + case.estimate.seconds, i))
        parts[i].append(k)
    return [[cases[k] for k in sorted(part)] for part in parts]


def units(cases: list[SweepCase], neighbours: tuple[str, ...], workers: int) -> deque[list[SweepCase]]:
    """Group cases into units, each computed in order by one worker; the most expensive unit comes first.

    Args:
        cases: All cases.
        neighbours: Keys along which a case can start from another. Cases that differ only in these form a sequence in
            which one key changes at a time. Without such keys, only short cases share a unit.
        workers: Number of workers. Sequences are cut so that each worker gets at least two units.
    """
    longest = math.ceil(len(cases) / (2 * workers))
    if not neighbours:
        return deque(_batches(cases, min(longest, MOST_CASES)))
    alike: dict[str, list[SweepCase]] = {}
    for case in cases:
        rest = {key: value for key, value in case.identity.items() if key not in (*neighbours, BLOCK)}
        alike.setdefault(json.dumps(rest, sort_keys=True), []).append(case)
    found = []
    for group in alike.values():
        sequence, pieces = _walk(group, neighbours), math.ceil(len(group) / longest)
        cuts = [i * len(sequence) // pieces for i in range(pieces + 1)]
        found += [sequence[a:b] for a, b in pairwise(cuts)]
    return deque(sorted(found, key=lambda unit: -sum(case.estimate.seconds for case in unit)))


def _batches(cases: list[SweepCase], most: int) -> list[list[SweepCase]]:
    """Group cases, the most expensive first, into batches of limited number and estimated time."""
    batches: list[list[SweepCase]] = []
    seconds = math.inf
    for case in sorted(cases, key=lambda case: -case.estimate.seconds):
        if seconds + case.estimate.seconds > MOST_SECONDS or len(batches[-1]) == most:
            batches.append([])
            seconds = 0.0
        batches[-1].append(case)
        seconds += case.estimate.seconds
    return batches


def _walk(group: list[SweepCase], keys: tuple[str, ...]) -> list[SweepCase]:
    """Order cases back and forth over the values of the keys, so that successive cases are neighbours in the grid."""
    if not keys:
        return group

    def place(case: SweepCase) -> tuple[Any, ...]:
        value = case.identity[keys[0]]
        return tuple(value) if isinstance(value, list) else (value,)

    walked: list[SweepCase] = []
    for i, (_, row) in enumerate(groupby(sorted(group, key=place), key=place)):
        rest = _walk(list(row), keys[1:])
        walked += rest[::-1] if i % 2 else rest
    return walked

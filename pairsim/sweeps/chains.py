"""Chains of neighbouring curves: each starts from the solutions of the one before."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import groupby, pairwise
from math import ceil
from typing import Any

from pairsim.cases.identity import identity_of
from pairsim.cases.physical import BLOCK
from pairsim.sweeps.grid import SweepCase


def chains(cases: Sequence[SweepCase], neighbours: Sequence[str], longest: int) -> list[list[SweepCase]]:
    """Group cases into chains, in the order of their first cases.

    Args:
        cases: All cases.
        neighbours: Keys along which a case can start from another. Cases that differ only in these form a sequence in
            which one key changes at a time. Without such keys each case is alone.
        longest: Largest number of cases in a chain; sequences are cut into equal parts.
    """
    if not neighbours or longest == 1:
        return [[case] for case in cases]
    alike: dict[str, list[SweepCase]] = {}
    for case in cases:
        rest = {key: value for key, value in identity_of(case.case).items() if key not in (*neighbours, BLOCK)}
        alike.setdefault(json.dumps(rest, sort_keys=True), []).append(case)
    found = []
    for group in alike.values():
        sequence, pieces = _walk(group, neighbours), ceil(len(group) / longest)
        cuts = [i * len(sequence) // pieces for i in range(pieces + 1)]
        found += [sequence[a:b] for a, b in pairwise(cuts)]
    return found


def _walk(group: list[SweepCase], keys: Sequence[str]) -> list[SweepCase]:
    """Order cases back and forth over the values of the keys, so that successive cases are neighbours in the grid."""
    if not keys:
        return group

    def place(case: SweepCase) -> tuple[Any, ...]:
        value = getattr(case.case, keys[0])
        return value if isinstance(value, tuple) else (value,)

    walked: list[SweepCase] = []
    for i, (_, row) in enumerate(groupby(sorted(group, key=place), key=place)):
        rest = _walk(list(row), keys[1:])
        walked += rest[::-1] if i % 2 else rest
    return walked

"""The entry of run.json for particles that differ."""

from __future__ import annotations

from pairsim.cases.case import SceneCase
from pairsim.cases.spread import SpreadCase
from pairsim.record.run_entries import SPREAD_OF_PARTICLES, Entries


def spread_entry(case: SceneCase) -> Entries:
    """The spread of the particles with their means; empty for equal particles."""
    if not isinstance(case, SpreadCase) or not case.spread:
        return {}
    means = {"beta": sum(case.betas) / case.n, "Ca_e": max(case.Ca_es)}
    return {SPREAD_OF_PARTICLES: {"diameter": case.spread.diameter, "modulus": case.spread.modulus, **means}}

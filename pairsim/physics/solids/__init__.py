"""Solids, one file for each law. Every law in this folder is in `LAWS` by its name."""

from __future__ import annotations

from pairsim.physics.material import laws_of
from pairsim.physics.solids.solid import Solid

LAWS: dict[str, type[Solid]] = laws_of(__name__, __path__, Solid)
"""The laws by their names in case files."""
DEFAULT = next(law for law in LAWS.values() if vars(law).get("default"))
"""The law of soft particles in a case that names none."""


def soft(*Ca_es: float) -> tuple[Solid | None, ...]:
    """Particles of the default law with given Ca_e; None, a rigid particle, where Ca_e is 0."""
    return tuple(DEFAULT(Ca_e) if Ca_e > 0 else None for Ca_e in Ca_es)


__all__ = ["DEFAULT", "LAWS", "Solid", "soft"]

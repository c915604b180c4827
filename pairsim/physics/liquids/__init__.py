"""Liquids, one file for each law. Every law in this folder is in `LAWS` by its name."""

from __future__ import annotations

from pairsim.physics.liquids.conformation import ConformationLaw
from pairsim.physics.liquids.liquid import NEWTONIAN, Liquid, single
from pairsim.physics.liquids.newtonian import Newtonian
from pairsim.physics.liquids.viscous import ViscousLaw
from pairsim.physics.liquids.yielding import YieldLaw
from pairsim.physics.material import laws_of

LAWS: dict[str, type[ViscousLaw | ConformationLaw]] = laws_of(__name__, __path__, ViscousLaw, ConformationLaw)
"""The laws by their names in case files."""
YIELDING: dict[str, type[YieldLaw]] = laws_of(__name__, __path__, YieldLaw)
"""The laws by which a yield stress stops the relaxation of a polymer, by their names."""
DEFAULT = next(law for law in LAWS.values() if vars(law).get("default"))
"""The law of a viscoelastic liquid in a case that names none."""


__all__ = [
    "DEFAULT",
    "LAWS",
    "NEWTONIAN",
    "YIELDING",
    "ConformationLaw",
    "Liquid",
    "Newtonian",
    "ViscousLaw",
    "YieldLaw",
    "single",
]

"""What a law of one's own is written with: `from pairsim.laws import ConformationLaw, Invariants, parameter`."""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING
from typing import Any as _Any

if _TYPE_CHECKING:
    from pairsim.physics import operations as operations
    from pairsim.physics.liquids.conformation import ConformationLaw as ConformationLaw
    from pairsim.physics.liquids.conformation import Invariants as Invariants
    from pairsim.physics.liquids.viscous import ViscousLaw as ViscousLaw
    from pairsim.physics.material import Dimension as Dimension
    from pairsim.physics.material import a_time as a_time
    from pairsim.physics.material import a_viscosity as a_viscosity
    from pairsim.physics.material import parameter as parameter
    from pairsim.physics.solids.solid import Solid as Solid

_PLACES = {
    **dict.fromkeys(("ConformationLaw", "Invariants"), "liquids.conformation"),
    **dict.fromkeys(("Dimension", "a_time", "a_viscosity", "parameter"), "material"),
    "ViscousLaw": "liquids.viscous",
    "Solid": "solids.solid",
    "operations": "operations",
}
__all__ = sorted(_PLACES)


def __getattr__(name: str) -> _Any:
    """Import a name when it is first used: the packages of laws import the files that import this one."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = _import_module(f"pairsim.physics.{_PLACES[name]}")
    return getattr(module, name, module)

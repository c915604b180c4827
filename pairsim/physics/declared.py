"""Declarations of all laws, for case files, `pairsim units`, pictures and reference pages."""

from __future__ import annotations

from typing import NamedTuple

from pairsim.physics import liquids, solids
from pairsim.physics.liquids import ConformationLaw, Liquid, ViscousLaw, YieldLaw
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.material import Material, Parameter
from pairsim.physics.own_laws import file_of, own_laws
from pairsim.physics.solids import Solid
from pairsim.quantities.measurable import Measurable
from pairsim.runtime.errors import InputError


def _add_own() -> None:
    for law in own_laws():
        if issubclass(law, Solid):
            other: type[Material] = solids.LAWS.setdefault(law.name, law)
        elif issubclass(law, YieldLaw):
            other = liquids.YIELDING.setdefault(law.name, law)
        elif issubclass(law, ViscousLaw | ConformationLaw):
            other = liquids.LAWS.setdefault(law.name, law)
        else:
            kinds = ", ".join(kind.__name__ for kind in (ViscousLaw, ConformationLaw, YieldLaw))
            raise InputError(str(file_of(law)), law.__name__, None, f"must be derived from {kinds} or {Solid.__name__}")
        if other is not law and file_of(other) != (own := file_of(law)):
            raise InputError(str(own), f"{law.__name__}.name", law.name, "is the name of another law")


_add_own()
LAWS: dict[str, type[Material]] = {**liquids.LAWS, **liquids.YIELDING, **solids.LAWS}
"""All laws by name."""


def _dimensions() -> dict[str, Measurable]:
    units = [law.measured for law in LAWS.values() if issubclass(law, ViscousLaw)]
    shared = [parameter.dimension for parameter in Liquid.OF_POLYMER.values()]
    own = [parameter.dimension for law in LAWS.values() for parameter in law.parameters().values()]
    return {each.key: each for each in (ZERO_SHEAR, *units, *shared, *own) if each is not None}


class Named(NamedTuple):
    """Parameters of the same name.

    Attributes:
        parameter: The declaration of the first law that has one.
        laws: Names of the laws that have one.
    """

    parameter: Parameter
    laws: list[str]


def _named() -> dict[str, Named]:
    found: dict[str, Named] = {}
    for law in LAWS.values():
        for name, parameter in law.parameters().items():
            found.setdefault(name, Named(parameter, [])).laws.append(law.name)
    return found


FIELDS = {name: field for law in LAWS.values() for name, field in law.fields.items()}
"""The fields that laws add to fields.xdmf and to pictures, by name."""
DIMENSIONS = _dimensions()
"""The measurable quantities of materials except the modulus, by key: those of all liquids, then those of each law."""
PARAMETERS = _named()
"""The parameters of all laws by name."""

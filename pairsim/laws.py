"""All that a law of your own needs: `from pairsim.laws import ConformationLaw, Invariants, parameter`."""

from pairsim.physics import operations
from pairsim.physics.fields import Field
from pairsim.physics.liquids.conformation import ConformationLaw, Invariants
from pairsim.physics.liquids.structured import StructuredLaw
from pairsim.physics.liquids.viscous import ViscousLaw
from pairsim.physics.liquids.yielding import YieldLaw
from pairsim.physics.material import parameter
from pairsim.physics.solids.solid import Solid
from pairsim.quantities import kinds
from pairsim.quantities.measurable import Measurable, a_time, a_viscosity

__all__ = ["ConformationLaw", "Field", "Invariants", "Measurable", "Solid", "StructuredLaw", "ViscousLaw", "YieldLaw"]
__all__ += ["a_time", "a_viscosity", "kinds", "operations", "parameter"]

"""Laws of the conformation tensor c, each a mode of a viscoelastic liquid.

A mode with relaxation time De (in units of D_c/U_av) and modulus G obeys

    De (upper-convected derivative of c) = -(g_0 I + g_1 c + g_2 c^2),    tau = G (h_0 I + h_1 c),

with scalars g_k of the invariants of c and the shear rate, h_k of the invariants of c, and G = (1 - xi) weight/De. By
the theorem of Cayley and Hamilton every isotropic relaxation is of this form, and every isotropic stress without c^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from pairsim.physics.fields import Field
from pairsim.physics.material import Material, Parameter

# A liquid with a smaller alpha or epsilon hardens in extension as Oldroyd-B does, with thin layers of stress. A guess:
# measured were alpha 0.2 and epsilon 0.25 on one side, and Oldroyd-B, with 0, on the other.
LEAST_THINNING = 0.1
# The weight in the norm of a time step was chosen such that dU follows that of finer steps through the start-up.
LOG_CONFORMATION = Field("s", 2, 4, odd=(1,), transported=True, step_weight=0.4, most_change=1.0)
"""s = log c of a mode, with the components (zz, zr, rr, tt)."""


@dataclass(frozen=True)
class Invariants:
    """The arguments of the scalars of a law.

    Attributes:
        trace: tr c.
        square: tr c^2.
        gamma2: Square of the shear rate [(U_av/D_c)^2], above 0, on which relaxation may depend.
    """

    trace: Any
    square: Any
    gamma2: Any


@dataclass(frozen=True)
class ConformationLaw(Material):
    """A law of the conformation tensor.

    The equilibrium is c = I, where the relaxation g_0 + g_1 + g_2 and the stress h_0 + h_1 vanish; there
    g_1 + 2 g_2 = 1 and h_1 = 1, which defines De and G.

    Attributes:
        time: Relaxation time of the mode over that of the liquid's Deborah number.
        weight: Fraction of the polymer viscosity that is due to the mode; those of a liquid add up to 1.
        hardens: Whether the law hardens in extension as Oldroyd-B does, with thin layers of stress at particles.
        largest_trace: Bound of tr c beyond which the law is not defined, None without one.
    """

    time: Any = 1.0
    weight: Any = 1.0

    OF_MODE: ClassVar[dict[str, Parameter]] = {
        "time": Parameter("\\lambda_i/\\lambda", "relaxation time of the mode over that of De", 1e-6, 1e6),
        "weight": Parameter("w_i", "part of the mode in the viscosity of all modes", 0.0, 1e6, open=True),
    }

    def relaxation(self, at: Invariants) -> tuple[Any, Any, Any]:
        """The scalars g_0, g_1 and g_2."""
        raise NotImplementedError

    def stress(self, at: Invariants) -> tuple[Any, Any]:
        """The scalars h_0 and h_1, which do not depend on the shear rate."""
        return -1.0, 1.0

    @property
    def hardens(self) -> bool:
        return True

    @property
    def follows_rate(self) -> bool:
        """Whether relaxation depends on the shear rate."""
        return self.relaxation(Invariants(3.5, 4.5, 1.0)) != self.relaxation(Invariants(3.5, 4.5, 2.0))

    @property
    def largest_trace(self) -> Any:
        return None

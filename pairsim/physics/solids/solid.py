"""Incompressible isotropic solids: the stress as a function of the left Cauchy-Green tensor B.

    sigma = [b_1 (B - I) + b_2 (B^-1 - I)]/Ca_e,    b_1 - b_2 = 1 at rest,

with scalars b_k of the invariants I_1 = tr B and I_2 = tr B^-1, in units of eta_0 U_av/D_c. With an elastic energy
W(I_1, I_2) in units of the shear modulus G_p they are b_1 = 2 dW/dI_1 and b_2 = -2 dW/dI_2 (Rivlin 1948).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

from pairsim.physics.material import Material, Parameter
from pairsim.quantities import kinds
from pairsim.quantities.measurable import Measurable, Usual

MODULUS = Measurable(
    "modulus",
    kinds.MODULUS,
    "shear modulus G_p; gives Ca_e = eta_0 U_av/(D_c G_p); for rigid particles give Ca_e: 0 instead",
    "5 kPa",
    "G_p",
    gives=("Ca_e",),
    inverse=True,
    many=True,
    uncertain=True,
    each="spread.modulus",
    usual=Usual(1.0, 1e11, "1 Pa to 100 GPa"),
    default="rigid",
)


@dataclass(frozen=True)
class Solid(Material):
    """A law of a soft particle.

    Attributes:
        Ca_e: Elastic capillary number eta_0 U_av/(D_c G_p), above 0.
    """

    Ca_e: Any

    OF_ALL: ClassVar[dict[str, Parameter]] = {
        "Ca_e": Parameter(
            r"\mathrm{Ca}_e",
            "elastic capillary number eta_0 U_av/(D_c G_p); 0 is a rigid particle",
            1e-6,
            1e4,
            dimension=MODULUS,
        )
    }

    @classmethod
    def anyhow(cls) -> Self:
        return cls(1.0, **{name: p.least if p.default is None else p.default for name, p in cls.parameters().items()})

    @property
    def numbers(self) -> dict[str, float]:
        return {"Ca_e": self.Ca_e, **super().numbers}

    def response(self, I1: Any, I2: Any) -> tuple[Any, Any]:
        """The scalars b_1 and b_2; one that is always zero is returned as the integer 0."""
        raise NotImplementedError

    @property
    def viscosity(self) -> Any:
        """Viscosity of the solid over eta_0, None if it is purely elastic."""
        return None

    def stress(self, B: tuple[Any, Any, Any, Any]) -> tuple[Any, Any, Any, Any]:
        """Elastic stress from B, components (zz, zr, rr, tt) each; UFL expressions or arrays."""
        zz, zr, rr, tt = B
        det = zz * rr - zr * zr
        inverse = rr / det, -zr / det, zz / det, 1 / tt
        b1, b2 = self.response(zz + rr + tt, inverse[0] + inverse[2] + inverse[3])
        unit = 1, 0, 1, 1
        terms = [(b, tensor) for b, tensor in ((b1, B), (b2, inverse)) if not (isinstance(b, int) and b == 0)]
        parts = [sum(b * (tensor[i] - unit[i]) for b, tensor in terms) / self.Ca_e for i in range(4)]
        return parts[0], parts[1], parts[2], parts[3]

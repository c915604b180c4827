"""Constitutive laws of viscoelastic liquids in terms of the conformation tensor c, written as one family:

    De (upper-convected derivative of c) = -Y(tr c) [F(tr c) c - I + alpha (c - I)^2],
    tau = (1 - xi)/De (F c - I),

with Y = F = 1 and alpha = 0 for Oldroyd-B, alpha > 0 for Giesekus (the paper's Eq. (5)), Y = 1 + epsilon (tr c - 3) or
its exponential exp(epsilon (tr c - 3)) for PTT, and F = (L2 - 3)/(L2 - tr c) for FENE-P. References are in "Liquids",
docs/explanation/physics.md. The functions accept numbers, numpy arrays and UFL expressions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

Name = Literal["oldroyd-b", "giesekus", "ptt-linear", "ptt-exp", "fene-p"]
PARAMETERS: dict[str, tuple[Name, ...]] = {
    "alpha": ("giesekus",),
    "epsilon": ("ptt-linear", "ptt-exp"),
    "L2": ("fene-p",),
}
"""Parameters other than De and xi, with the laws that have them."""


@dataclass(frozen=True)
class Law:
    """A constitutive law with all its parameters except De, which may vary along a branch of solutions.

    Attributes:
        name: Name of the law.
        xi: Solvent viscosity divided by eta_0.
        alpha: Mobility of the Giesekus law.
        epsilon: Extensional parameter of the PTT laws.
        L2: Upper bound of tr c in the FENE-P law.
    """

    name: Name
    xi: float
    alpha: float = 0.0
    epsilon: float = 0.0
    L2: float = 0.0

    def at(self, De: float) -> Polymer:
        """The law at a given Deborah number."""
        return Polymer(self.name, self.xi, self.alpha, self.epsilon, self.L2, De=De)


@dataclass(frozen=True)
class Polymer(Law):
    """The polymer contribution to a liquid: a constitutive law at a given Deborah number.

    Attributes:
        De: Deborah number, above 0.
    """

    De: float = field(kw_only=True)


def relaxation(name: Name, trace: Any, epsilon: Any, exp: Callable[[Any], Any]) -> Any:
    """Factor Y(tr c) of the relaxation rate: different from 1 in the PTT laws.

    Args:
        name: Name of the law.
        trace: tr c.
        epsilon: Extensional parameter.
        exp: Exponential function for the type of `trace`, such as `numpy.exp` or `ufl.exp`.
    """
    if name == "ptt-linear":
        return 1 + epsilon * (trace - 3)
    if name == "ptt-exp":
        return exp(epsilon * (trace - 3))
    return 1.0


def spring(name: Name, trace: Any, L2: Any) -> Any:
    """Spring factor F(tr c): different from 1 in the FENE-P law, where it diverges as tr c approaches L2."""
    return (L2 - 3) / (L2 - trace) if name == "fene-p" else 1.0

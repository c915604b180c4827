"""Viscoelastic liquids in terms of the conformation c, all of one family.

    De (upper-convected derivative of c) = -Y(tr c) [F(tr c) c - I + alpha (c - I)^2],
    tau = (1 - xi)/De (F c - I),

with Y = F = 1 and alpha = 0 for Oldroyd-B, alpha > 0 for Giesekus (the paper's Eq. (5)), Y = 1 + epsilon (tr c - 3) or
its exponential for PTT, F = (L2 - 3)/(L2 - tr c) for FENE-P. The functions work on numbers, numpy arrays and UFL alike.
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
"""Parameters beyond De and xi, with the laws that they belong to."""


@dataclass(frozen=True)
class Law:
    """A constitutive law with all its numbers but De, which changes along a branch of solutions.

    Attributes:
        name: Which law.
        xi: Solvent viscosity over eta_0.
        alpha: Giesekus mobility.
        epsilon: PTT's extensional parameter.
        L2: Largest trace of c of FENE-P.
    """

    name: Name
    xi: float
    alpha: float = 0.0
    epsilon: float = 0.0
    L2: float = 0.0

    def at(self, De: float) -> Polymer:
        """The polymer at a Deborah number."""
        return Polymer(self.name, self.xi, self.alpha, self.epsilon, self.L2, De=De)


@dataclass(frozen=True)
class Polymer(Law):
    """The viscoelastic part of a liquid: a law at a Deborah number."""

    De: float = field(kw_only=True)


def relaxation(name: Name, trace: Any, epsilon: Any, exp: Callable[[Any], Any]) -> Any:
    """Y(tr c)."""
    if name == "ptt-linear":
        return 1 + epsilon * (trace - 3)
    if name == "ptt-exp":
        return exp(epsilon * (trace - 3))
    return 1.0


def spring(name: Name, trace: Any, L2: Any) -> Any:
    """F(tr c)."""
    return (L2 - 3) / (L2 - trace) if name == "fene-p" else 1.0

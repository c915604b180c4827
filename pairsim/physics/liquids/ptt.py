"""Liquids of Phan-Thien and Tanner (1977, 1978) without slip: with a linear and an exponential function of tr c."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pairsim.physics.liquids.conformation import LEAST_THINNING, ConformationLaw, Invariants
from pairsim.physics.material import parameter
from pairsim.physics.operations import exp


@dataclass(frozen=True)
class _PhanThienTanner(ConformationLaw):
    """De (upper-convected derivative of c) = -Y(tr c) (c - I)."""

    epsilon: Any = parameter(r"\epsilon", "extensional parameter of the PTT liquids", 0.0, 100.0)

    def rate(self, stretch: Any) -> Any:
        """Factor Y of the relaxation rate, from tr c - 3."""
        raise NotImplementedError

    def relaxation(self, at: Invariants) -> tuple[Any, Any, Any]:
        Y = self.rate(at.trace - 3)
        return -Y, Y, 0.0

    @property
    def hardens(self) -> bool:
        return bool(self.epsilon < LEAST_THINNING)


@dataclass(frozen=True)
class LinearPTT(_PhanThienTanner):
    """Y = 1 + epsilon (tr c - 3)."""

    name = "ptt-linear"
    label = "linear PTT"
    words = "network whose junctions break as it is stretched: shear thinning, bounded stress in extension"

    def rate(self, stretch: Any) -> Any:
        return 1 + self.epsilon * stretch


@dataclass(frozen=True)
class ExponentialPTT(_PhanThienTanner):
    """Y = exp[epsilon (tr c - 3)]."""

    name = "ptt-exp"
    label = "exponential PTT"
    words = "network whose junctions break ever faster as it is stretched: thinning in shear and in strong extension"

    def rate(self, stretch: Any) -> Any:
        return exp(self.epsilon * stretch)

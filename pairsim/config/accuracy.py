"""What `accuracy:` stands for: cells and tolerances for an error of dU, as a part of the curve's peak.

docs/notebook/accuracy.md has what was measured with them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

Accuracy = Literal["5%", "1%", "0.1%"]
Liquid = Literal["newtonian", "thinning", "hardening"]
# Below this alpha or epsilon a Giesekus or PTT liquid is taken to harden in extension as Oldroyd-B does: a guess
# between what was measured, alpha .2 and epsilon .25 on one side and Oldroyd-B on the other.
LEAST_THINNING = 0.1
PIPE_CELL = 0.05  # a tube without particles has few cells, and profiles across it are all there is


@dataclass(frozen=True)
class Cells:
    """Sizes of cells.

    Attributes:
        Np: Cells on a half-circle.
        max_size: Largest cell [D_c].
        per_beta: Largest cell over the smallest diameter; what matters is the smaller of the two.
        rows: Distance from the particles beyond which cells lie in rows [D_c]; 0: nowhere.
    """

    Np: int
    max_size: float
    per_beta: float = math.inf
    rows: float = 0.0

    def largest(self, beta: float) -> float:
        """Largest cell around particles the smallest of which has this diameter [D_c]."""
        return min(self.max_size, self.per_beta * beta)


@dataclass(frozen=True)
class Settings:
    """Settings of an accuracy.

    Attributes:
        newtonian, thinning: Cells in a Newtonian and in a viscoelastic liquid, whose stresses the flow carries far.
        hardening: Cells in a viscoelastic liquid that hardens in extension: its stress lies in thin layers at the
            particles.
        s_jump: Change of log c within a cell beyond which larger errors were measured.
        time_tol: Local error of velocities [U_av] that BDF2 would be allowed in a run.
        curve_tol: Allowed error between the points of a curve, as a part of its peak.
    """

    newtonian: Cells
    thinning: Cells
    hardening: Cells
    s_jump: float
    time_tol: float
    curve_tol: float

    def cells(self, liquid: Liquid) -> Cells:
        """The cells in a liquid."""
        return {"newtonian": self.newtonian, "thinning": self.thinning, "hardening": self.hardening}[liquid]

    def mesh(self, liquid: Liquid, betas: Iterable[float]) -> dict[str, Any]:
        """The keys of `mesh` for a scene with these particles."""
        chosen = self.cells(liquid)
        beta = min(betas, default=0.0)
        if not beta:
            return {"Np": chosen.Np, "max_size": chosen.max_size if liquid == "newtonian" else PIPE_CELL, "rows": 0.0}
        return {"Np": chosen.Np, "max_size": chosen.largest(beta), "rows": chosen.rows}

    def under(self, case: dict[str, Any], fields: set[str]) -> dict[str, Any]:
        """The keys of a case with these settings wherever it says nothing itself.

        Args:
            case: What the user wrote, not yet checked.
            fields: Keys that this kind of case has.
        """
        groups = {"mesh": self.mesh(liquid_of(case), _diameters(case))}
        if "time" in fields:
            groups["time"] = {"tol": self.time_tol}
        filled = ({"tol": self.curve_tol} if "tol" in fields else {}) | case
        for name, values in groups.items():
            given = case.get(name, {})
            if isinstance(given, dict):  # anything else is for the model to refuse
                filled[name] = values | given
        return filled


def liquid_of(case: dict[str, Any]) -> Liquid:
    """Which cells the liquid of a case wants; the case may not be checked yet."""
    De, law = case.get("De"), case.get("liquid") or "giesekus"
    if not isinstance(De, (int, float)) or De <= 0 or law == "newtonian":
        return "newtonian"
    if law in ("oldroyd-b", "fene-p"):
        return "hardening"
    mobility = case.get("alpha" if law == "giesekus" else "epsilon")
    return "hardening" if isinstance(mobility, (int, float)) and mobility < LEAST_THINNING else "thinning"


def _diameters(case: dict[str, Any]) -> list[float]:
    """Diameters in a case that is not yet checked: what is not a diameter is for the model to refuse."""
    beta = case.get("beta")
    given = beta if isinstance(beta, (list, tuple)) else [beta]
    return [b for b in given if isinstance(b, (int, float)) and 0 < b < 1] if case.get("particles", 2) else []


_SMALL, _SMALLEST = Cells(28, 0.05, 0.25, 0.5), Cells(80, 0.025, 0.125, 0.5)
SETTINGS: dict[Accuracy, Settings] = {
    "5%": Settings(Cells(20, 0.2), Cells(20, 0.1, 0.35, 0.5), _SMALL, s_jump=2.0, time_tol=1e-3, curve_tol=1e-2),
    "1%": Settings(Cells(40, 0.2), _SMALL, Cells(64, 0.05, 0.25, 0.5), s_jump=1.6, time_tol=3e-4, curve_tol=2e-3),
    "0.1%": Settings(Cells(56, 0.14), _SMALLEST, _SMALLEST, s_jump=1.0, time_tol=5e-5, curve_tol=5e-4),
}
DEFAULT: Accuracy = "1%"

"""What `accuracy:` stands for: cells and tolerances for an error of dU, as a part of the curve's peak.

docs/accuracy.md has what was measured with them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

Accuracy = Literal["5%", "1%", "0.1%"]
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
        newtonian, elastic: Cells in a Newtonian and in a viscoelastic liquid, whose stresses the flow carries far.
        time_tol: Local error of velocities [U_av] that BDF2 would be allowed in a run.
        curve_tol: Allowed error between the points of a curve, as a part of its peak.
    """

    newtonian: Cells
    elastic: Cells
    time_tol: float
    curve_tol: float

    def mesh(self, elastic: bool, betas: Iterable[float]) -> dict[str, Any]:
        """The keys of `mesh` for a scene with these particles."""
        chosen = self.elastic if elastic else self.newtonian
        beta = min(betas, default=0.0)
        if not beta:
            return {"Np": chosen.Np, "max_size": PIPE_CELL if elastic else chosen.max_size, "rows": 0.0}
        return {"Np": chosen.Np, "max_size": chosen.largest(beta), "rows": chosen.rows}

    def under(self, case: dict[str, Any], fields: set[str]) -> dict[str, Any]:
        """The keys of a case with these settings wherever it says nothing itself.

        Args:
            case: What the user wrote, not yet checked.
            fields: Keys that this kind of case has.
        """
        De = case.get("De")
        elastic = isinstance(De, (int, float)) and De > 0 and case.get("liquid") != "newtonian"
        groups = {"mesh": self.mesh(elastic, _diameters(case))}
        if "time" in fields:
            groups["time"] = {"tol": self.time_tol}
        filled = ({"tol": self.curve_tol} if "tol" in fields else {}) | case
        for name, values in groups.items():
            given = case.get(name, {})
            if isinstance(given, dict):  # anything else is for the model to refuse
                filled[name] = values | given
        return filled


def _diameters(case: dict[str, Any]) -> list[float]:
    """Diameters in a case that is not yet checked: what is not a diameter is for the model to refuse."""
    beta = case.get("beta")
    given = beta if isinstance(beta, (list, tuple)) else [beta]
    return [b for b in given if isinstance(b, (int, float)) and 0 < b < 1] if case.get("particles", 2) else []


SETTINGS: dict[Accuracy, Settings] = {
    "5%": Settings(Cells(20, 0.2), Cells(20, 0.1, 0.35, 0.5), 1e-3, 1e-2),
    "1%": Settings(Cells(40, 0.2), Cells(28, 0.05, 0.25, 0.5), 3e-4, 2e-3),
    "0.1%": Settings(Cells(56, 0.14), Cells(80, 0.025, 0.125, 0.5), 5e-5, 5e-4),
}
DEFAULT: Accuracy = "1%"

"""Rigid spheres in a Newtonian liquid against exact multipole solutions: free, dragged, held, and pairs."""

from __future__ import annotations

from math import pi

import pairsim
from validation_book.comparisons import CONFIGS, Comparison, Found, Keys, Setting, against, reference, rows_of

BETAS = (0.2, 0.4, 0.6)
ALONE, PAIR = CONFIGS / "rigid-sphere.yaml", CONFIGS / "rigid-pair.yaml"


def compute(setting: Setting) -> Found:
    """Velocities, extra pressure drops and forces."""
    rows: list[Comparison] = []
    for beta in BETAS[1:2] if setting.quick else BETAS:
        rows += [*free(beta), *moved(beta)]
    return Found([*rows, *pairs()])


def free(beta: float) -> list[Comparison]:
    """A force-free sphere."""
    (row,) = rows_of(pairsim.curve(ALONE, beta=beta))
    what, known = (
        f"free sphere, beta {beta:g}",
        [reference("rigid sphere", f"{q} beta {beta:g}") for q in ("U", "dp_plus")],
    )
    return [
        against(known[0], what, "U", row["U_1"], 1e-6, headline=beta == 0.4),
        against(known[1], what, "dp_plus", row["dp_plus"], 2e-3, headline=beta == 0.4),
    ]


def moved(beta: float) -> list[Comparison]:
    """Drag on a sphere in a liquid at rest, and on one that is held in the flow."""
    rows = []
    motions: dict[str, tuple[Keys, float]] = {
        "dragged": ({"velocity": 1, "flow": 0}, 1.0),
        "held": ({"velocity": 0}, -2.0),
    }
    for key, (motion, U) in motions.items():
        (row,) = rows_of(pairsim.curve(ALONE, beta=beta, **motion))
        unit = 3 * pi * beta * U
        known = reference("drag", f"{key} beta {beta:g}")
        K = row["F_1"] / unit
        what = f"{key} sphere, beta {beta:g}"
        rows.append(
            against(known, what, "K", K, 2e-5, error=row["F_error_1"] / abs(unit), table="drag", headline=beta == 0.4)
        )
    return rows


def pairs() -> list[Comparison]:
    """Two equal spheres, which keep their distance."""
    rows = []
    for row in rows_of(pairsim.curve(PAIR)):
        d = row["d"]
        what = f"free pair, beta 0.4, d {d:g}"
        U, none, dp = (reference("rigid pair", key) for key in (f"U d {d:g}", "dU", f"dp_plus d {d:g}"))
        more: Keys = {"error": row["dU_error"], "headline": d == 0.1}
        rows += [
            against(U, what, "U", row["U_L"], 1e-6, table="pairs"),
            against(dp, what, "dp_plus", row["dp_plus"], 1e-3, table="pairs"),
            against(none, what, "dU", row["dU"], 1e-11, table="pairs", **more),
        ]
    return rows

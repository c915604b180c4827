"""Spheres in power-law liquids: the drag on a rigid one in the tube, and the shapes of soft ones in cytometry."""

from __future__ import annotations

from math import pi

import pairsim
from pairsim.results.units import with_error
from validation_book.comparisons import (
    CONFIGS,
    Found,
    Keys,
    Setting,
    against,
    reference,
    rows_of,
    text_table,
    verification,
)

DRAGGED, CARRIED = CONFIGS / "dragged-sphere.yaml", CONFIGS / "cytometry-sphere.yaml"
BETA = 0.5
INDICES = (1.0, 0.8, 0.6, 0.4)
MESHES = ("1%", "0.1%")
BETAS = (0.35, 0.5, 0.6, 0.7)
COARSE: Keys = {"mesh": {"Np": 14, "max_size": 0.15}}


def compute(setting: Setting) -> Found:
    """Drags on two meshes and of an unbounded liquid, deformations beside those of a table of cytometry."""
    test = verification("test_materials_in_scenes")
    rows, lines = [], []
    for n in INDICES[:2] if setting.quick else INDICES:
        found = [drag(n, COARSE if setting.quick else {"accuracy": name}) for name in MESHES]
        (K, error), group = found[-1], "drag in a power-law liquid"
        if n >= 0.8:
            known = reference(group, f"X n {n:g}")
            rows.append(against(known, f"n {n:g}", "X", K, 2e-3 if setting.quick else 2e-4, error=error, headline=True))
        cells = [with_error(*each).replace("+-", "±") for each in found]
        lines.append([f"{n:g}", *cells, f"{test.ritz(n, (1, 3, 5, 7), 16):.4f}"])
    for beta in (0.5,) if setting.quick else BETAS:
        shapes = rows_of(pairsim.shape(CARRIED, beta=beta, **(COARSE if setting.quick else {})))
        for row in shapes:
            key = f"beta {beta:g}, Ca_e {row['Ca_e']:g}"
            known = reference("cytometry", key)
            own = {"table": "cytometry", "headline": key == "beta 0.5, Ca_e 0.1"}
            rows.append(against(known, key, "deformation", row["deformation_hull"], 0.015, **own))
    head = ["n", *(f"X, mesh of {name}" for name in MESHES), "X, unbounded (upper bound)"]
    return Found(rows, {"drag": text_table(head, lines)})


def drag(n: float, keys: Keys) -> tuple[float, float]:
    """F over 3 pi K V^n D_p^(2 - n), and its half-width."""
    (row,) = rows_of(pairsim.curve(DRAGGED, liquid={"law": "power-law", "n": n}, **keys))
    unit = 3 * pi * BETA ** (2 - n)
    return row["F_1"] / unit, row["F_error_1"] / unit

"""Soft pairs of two diameters in a Newtonian liquid, each curve a part, and what there is in a Giesekus liquid."""

from __future__ import annotations

from pathlib import Path

from book import yaml_files
from book.case_parts import case_of, case_part
from book.study import Part

from studies.pyoomph import viscoelastic

CURVE = yaml_files.read(Path(__file__).with_name("curve.yaml"))
DISTANCES = {0.4: (0.05, 0.1, 0.2, 0.4, 0.8), 0.2: (0.05, 0.1, 0.2, 0.4)}


def parts(quick: bool) -> list[Part]:
    """All parts; in the quick form a distance of a curve in a Newtonian liquid."""
    places = {0.4: (0.1,)} if quick else DISTANCES
    columns = ("d", "dU_held", "dU_error", "slope", "D_T", "D_L")
    curves = [
        case_part(
            f"beta {beta:g}", "curve", case_of(CURVE, beta=beta, d=list(d), max_points=len(d)), columns, {"beta": beta}
        )
        for beta, d in places.items()
    ]
    return curves if quick else [*curves, *viscoelastic.parts()]

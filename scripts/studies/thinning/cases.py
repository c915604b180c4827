"""Dragged and carried spheres: the parts of the study."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from book import yaml_files
from book.case_parts import case_of, case_part
from book.study import Part, Row

from studies.thinning.unbounded import ritz

HERE = Path(__file__).parent
DRAGGED, CARRIED = (yaml_files.read(HERE / f"{name}.yaml") for name in ("dragged-sphere", "cytometry-sphere"))
EXPONENTS, ACCURACIES = (1.0, 0.8, 0.6, 0.4), ("1%", "0.1%")
ORDERS, COUNT = (1, 3, 5, 7), 16
"""Of the trial functions in an unbounded liquid."""
BETAS = (0.35, 0.5, 0.6, 0.7)


def parts(quick: bool) -> list[Part]:
    """Dragged spheres in four liquids at two accuracies, and carried ones of four diameters; drag without walls."""
    dragged = [
        case_part(
            f"dragged-{n:g}+{accuracy}",
            "curve",
            case_of(DRAGGED, accuracy=accuracy, **{"liquid.n": n}),
            ("F_1", "F_error_1"),
            {"kind": "dragged", "beta": DRAGGED["beta"], "n": n, "accuracy": accuracy},
        )
        for n in EXPONENTS[: 2 if quick else None]
        for accuracy in (("0.5%",) if quick else ACCURACIES)
    ]
    carried = [
        case_part(
            f"carried-{beta:g}",
            "shape",
            case_of(CARRIED, beta=beta),
            ("Ca_e", "deformation_hull"),
            {"kind": "carried", "beta": beta},
        )
        for beta in ((0.5,) if quick else BETAS)
    ]
    if quick:
        return [*dragged, *carried]
    unbounded = [
        Part(f"unbounded-{n:g}", f"n {n:g}, trial functions {ORDERS}, {COUNT}", partial(_rows, n)) for n in EXPONENTS
    ]
    return [*dragged, *carried, *unbounded]


def _rows(n: float, folder: Path) -> Sequence[Row]:
    """The upper bound of the drag in an unbounded liquid."""
    return [{"kind": "unbounded", "n": n, "X": ritz(n, ORDERS, COUNT), "ended": None}]

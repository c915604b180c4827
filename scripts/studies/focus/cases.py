"""Rates of displaced spheres: the parts of the study."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import inf
from pathlib import Path

from book.apart import apart
from book.study import Part, Row

from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.liquid import single
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.solids import Solid, soft
from pairsim.solvers.focus.errors import half_widths
from pairsim.solvers.focus.inertia import by_inertia
from pairsim.solvers.focus.rates import Displacement
from studies.focus.scenes import resistance, scene

DE, CA_E, XI = 0.002, 1e-3, 0.09
"""Small enough for what is of first order in them."""
ALPHAS = (0.0, 0.2, 1.0)
"""Mobilities of the Giesekus liquids; with 0 it is an Oldroyd-B liquid."""
WIDER = 1.094
"""Diameter of the tube over the width of the square duct."""
BETAS, SMALL, WIDTHS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6), (0.05, 0.1), (0.05, 0.1, 0.15, 0.2)
"""Diameters of the spheres, those from which limits are extrapolated, and those over the width of the duct."""


def giesekus(alpha: float) -> Liquid:
    """A Giesekus liquid of small De."""
    return single(Giesekus(alpha=alpha) if alpha else OldroydB(), DE, XI)


def rate(beta: float, alpha: float | None, Np: int, *, known: bool) -> Row:
    """The rate of a rigid sphere in a Giesekus liquid, or of a soft one in a Newtonian liquid."""
    solids: tuple[Solid | None, ...] = soft(CA_E) if alpha is None else (None,)
    liquid = NEWTONIAN if alpha is None else giesekus(alpha)
    with scene((beta,), solids, liquid, Np=Np) as solver, Displacement(solver) as found:
        half_width = float(half_widths(found).rates[0, 0]) if known else None
        return {"beta": beta, "alpha": alpha, "rate": float(found.found.rates[0, 0]), "half_width": half_width}


def inertia(beta: float, Np: int) -> Row:
    """The derivative of the rate of a rigid sphere in a Newtonian liquid by Re, with its half-width; its velocity."""
    with scene((beta,), (None,), Np=Np) as solver, Displacement(solver) as found:
        by_Re = by_inertia(found).rates
        error = half_widths(found, by_Re).by_Re
        half_width = inf if error is None else float(error[0, 0])
        U = float(solver.observe().U[0])
    return {"beta": beta, "by_Re": float(by_Re[0, 0]), "half_width": half_width, "U": U}


def first_order(beta: float, Np: int) -> list[Row]:
    """What is of first order in De, Ca_e and Re."""
    rows = [rate(beta, alpha, Np, known=True) for alpha in (*ALPHAS, None)]
    return [{"kind": "first-order", **row} for row in (*rows, inertia(beta, Np))]


def limits(beta: float, Np: int) -> list[Row]:
    """Rates of a small rigid sphere with the lateral drag, and of a soft one twice as large."""
    drag = float(resistance(beta, Np)[0])
    rigid = [{**rate(beta, alpha, Np, known=False), "drag": drag} for alpha in ALPHAS]
    return [{"kind": "limits", **row} for row in (*rigid, rate(2 * beta, None, Np, known=False))]


def duct(size: float, Np: int) -> list[Row]:
    """Velocity, lateral drag and rate by inertia in the tube that stands for a square duct."""
    drag = float(resistance(size / WIDER, Np)[0])
    return [{"kind": "duct", "size": size, "drag": drag, **inertia(size / WIDER, Np)}]


def parts(quick: bool) -> list[Part]:
    """All of these; the quick form has the limits and one duct, on coarse cells."""
    wanted: dict[Callable[[float, int], list[Row]], tuple[Sequence[float], int]] = {
        limits: (SMALL, 14 if quick else 24),
        first_order: (() if quick else BETAS, 24),
        duct: ((0.1,) if quick else WIDTHS, 12 if quick else 24),
    }
    return [
        Part(f"{function.__name__.replace('_', '-')} {size:g}", f"{function.__name__} {size:g}, N_p {Np}", compute)
        for function, (sizes, Np) in wanted.items()
        for size in sizes
        for compute in (partial(_rows, function, size, Np),)
    ]


def _rows(function: Callable[[float, int], list[Row]], size: float, Np: int, folder: Path) -> Sequence[Row]:
    return apart(function, size, Np)

"""Particles displaced from the axis: rates at first order, limits for small spheres, and spheres in a square duct."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.liquid import single
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.solids import soft
from pairsim.physics.solids.solid import Solid
from pairsim.solvers.focus.errors import half_widths
from pairsim.solvers.focus.inertia import by_inertia
from pairsim.solvers.focus.rates import Displacement
from validation_book.page import Page, verification

DE, CA_E, XI = 0.002, 1e-3, 0.09
"""Small enough for what is of first order in them."""
WIDER = 1.094
"""Diameter of the tube over the width of the square duct."""
SMALL = 0.05, 0.1
"""Betas from which limits are extrapolated."""
RIGID = (None,)


def viscoelastic_limit(beta: float, alpha: float) -> float:
    """Rate of a small rigid sphere in a Giesekus liquid, times its drag over that without walls."""
    return -16 * (1 + 11 * alpha / 9) * (1 - XI) * DE * beta**2


def soft_limit(beta: float) -> float:
    """Rate of a small soft sphere, -(100/9) Ca_e beta^2."""
    return -100 / 9 * CA_E * beta**2


def giesekus(alpha: float) -> Liquid:
    """A Giesekus liquid of small De; with alpha 0 it is an Oldroyd-B liquid."""
    return single(Giesekus(alpha=alpha) if alpha else OldroydB(), DE, XI)


def rate_of(beta: float, solids: tuple[Solid | None, ...], liquid: Liquid, Np: int) -> tuple[float, float]:
    """The rate of a sphere, and its half-width."""
    with verification("test_focus").scene((beta,), solids, liquid, Np=Np) as solver, Displacement(solver) as found:
        return float(found.found.rates[0, 0]), float(half_widths(found).rates[0, 0])


def by_Re_of(beta: float, Np: int) -> tuple[float, float]:
    """The derivative of the rate of a rigid sphere in a Newtonian liquid by Re, and its half-width."""
    with verification("test_focus").scene((beta,), (None,), Np=Np) as solver, Displacement(solver) as found:
        by_Re = by_inertia(found).rates
        error = half_widths(found, by_Re).by_Re
        return float(by_Re[0, 0]), np.inf if error is None else float(error[0, 0])


def first_order(page: Page) -> pd.DataFrame:
    """Rates over their limits for small spheres, and those of inertia over Re beta^3."""
    rows, Np = list[dict[str, Any]](), 12 if page.quick else 24
    for beta in (0.4,) if page.quick else (0.1, 0.2, 0.3, 0.4, 0.5, 0.6):
        row: dict[str, Any] = {"beta": beta}
        for alpha in (0.0, 0.2, 1.0):
            limit = viscoelastic_limit(beta, alpha)
            rate, error = rate_of(beta, RIGID, giesekus(alpha), Np)
            row |= {f"alpha {alpha:g}": rate / limit, f"error alpha {alpha:g}": error / abs(limit)}
        rate, error = rate_of(beta, soft(CA_E), NEWTONIAN, Np)
        row |= {"soft": rate / soft_limit(beta), "error soft": error / abs(soft_limit(beta))}
        by_Re, error = by_Re_of(beta, Np)
        rows.append(row | {"inertia": by_Re / beta**3, "error inertia": error / beta**3})
    return pd.DataFrame(rows)


def limits(page: Page) -> pd.DataFrame:
    """Rates of small spheres over their limits, extrapolated to beta 0 by the next order in it."""
    Np, test = 12 if page.quick else 24, verification("test_focus")
    found = {}
    for alpha in (0.0, 0.2, 1.0):
        one, two = (
            test.disturbed((beta,), RIGID, giesekus(alpha), Np=Np).rates[0, 0]
            / viscoelastic_limit(beta, alpha)
            * test.resistance(beta, Np)[0]
            for beta in SMALL
        )
        found[f"rigid, Giesekus, alpha {alpha:g}"] = (4 * one - two) / 3
    one, two = (test.disturbed((2 * beta,), soft(CA_E), Np=Np).rates[0, 0] / soft_limit(2 * beta) for beta in SMALL)
    found["soft, Newtonian"] = (8 * one - two) / 7
    return pd.Series(found, name="rate over limit").rename_axis("sphere").reset_index()


def duct(page: Page) -> pd.DataFrame:
    """Velocity, lateral drag and rate by inertia in the tube that stands for a square duct."""
    rows, test, Np = list[dict[str, Any]](), verification("test_focus"), 12 if page.quick else 24
    for size in (0.1,) if page.quick else (0.05, 0.1, 0.15, 0.2):
        with test.scene((size / WIDER,), (None,), Np=Np) as solver, Displacement(solver) as found:
            U, by_Re = float(solver.observe().U[0]), float(by_inertia(found).rates[0, 0])
        drag = float(test.resistance(size / WIDER, Np)[0])
        rows.append({"diameter over width": size, "U": U / 2, "drag": drag, "inertia": by_Re / size**3})
    return pd.DataFrame(rows)

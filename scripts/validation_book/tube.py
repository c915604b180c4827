"""Start-up and steady flow of every law in the tube without particles, on the mesh, against one dimension."""

from __future__ import annotations

from math import nan

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from pairsim.physics.liquids import Liquid, single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.pipe import Pipe
from pairsim.quantities.scales import FLOW_RATE, TUBE_RADIUS
from validation_book.page import Page, verification

CELLS, LENGTH = 0.05, 0.5  # of the mesh and of the piece of tube [D_c]
SETTLED = 20  # time of steady flow [De]


def on_mesh(liquid: Liquid, times: list[float]) -> list[tuple[float, float]]:
    """Pressure gradient and largest velocity at some times."""
    test = verification("test_viscoelastic")
    return list(test.pipe_in_two_dimensions(liquid, times, length=LENGTH, max_size=CELLS).values())


def giesekus(page: Page) -> pd.DataFrame:
    """The Giesekus liquid of the study: one-dimensional solver and mesh."""
    rows = []
    for De in (0.5, 1.0):
        flow, liquid = Pipe(single(Giesekus(), De)).steady(), single(Giesekus(), De)
        gradient, centre = (nan, nan) if page.quick else on_mesh(liquid, [SETTLED * De])[0]
        rows += [("dp/L", De, flow.gradient, gradient), ("u(0)", De, flow.u[0], centre)]
        rows += [
            (f"c_{name} wall", De, value, nan) for name, value in zip(("zz", "rz", "rr"), flow.c[-1], strict=False)
        ]
    return pd.DataFrame(rows, columns=["quantity", "De", "one dimension", "mesh"])


def laws(page: Page) -> pd.DataFrame:
    """Every law at De 0.8: the one-dimensional solver and the mesh, against the law's own steady shear."""
    test, rows = verification("test_viscoelastic"), []
    for name, liquid in test.LAWS.items():
        mesh = nan if page.quick else on_mesh(liquid, [SETTLED * liquid.De])[0][0]
        rows.append((name, Pipe(liquid).steady().gradient, mesh, gradient_of(liquid)))
    return pd.DataFrame(rows, columns=["law", "one dimension", "mesh", "exact"])


def gradient_of(liquid: Liquid, points: int = 40) -> float:
    """Pressure gradient at unit mean velocity from steady shear alone (Rabinowitsch).

    The shear stress sigma grows linearly with r, so that a shear rate g is found at r = R sigma(g)/sigma(g_w), and the
    flow rate is pi (R^3 g_w - int_0^g_w r(g)^3 dg)/3.
    """
    x, w = np.polynomial.legendre.leggauss(points)
    steady_shear = verification("test_laws").steady_shear

    def sigma(rate: float) -> float:
        polymer = (1 - liquid.xi) / liquid.De * steady_shear(liquid.modes[0], liquid.De * rate)[0]
        return float(liquid.xi * rate + polymer)

    def excess(wall: float) -> float:
        at_wall = sigma(wall)
        r = np.array([TUBE_RADIUS * sigma(rate) / at_wall for rate in wall * (x + 1) / 2])
        return float(np.pi * (TUBE_RADIUS**3 * wall - wall / 2 * w @ r**3) / 3 - FLOW_RATE)

    return 2 * sigma(float(brentq(excess, 6.0, 60.0, xtol=1e-9))) / TUBE_RADIUS


def start_up(page: Page) -> pd.DataFrame:
    """Pressure gradient after start-up at constant flow rate, De 1, on the mesh; that of Oldroyd-B is known exactly."""
    t, liquids = list(verification("test_viscoelastic").START_UP), [single(law(), 1.0) for law in (Giesekus, OldroydB)]
    found = {
        name: [dp for dp, _ in on_mesh(each, t)] for name, each in zip(("Giesekus", "Oldroyd-B"), liquids, strict=True)
    }
    xi = liquids[1].xi
    return pd.DataFrame({"t": t, **found, "exact": 32 * (xi + (1 - xi) * (1 - np.exp(-np.array(t))))})

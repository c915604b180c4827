"""Start-up and steady flow of every law in the tube without particles, on the mesh, against one dimension."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import brentq

from pairsim.physics.liquids import Liquid, single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.pipe import Pipe
from pairsim.physics.scales import FLOW_RATE, TUBE_RADIUS
from validation_book.comparisons import Comparison, Found, Setting, against, reference, verification

CELLS, LENGTH = 0.05, 0.5  # of the mesh and of the piece of tube [D_c]
OWN = "steady shear of the law written for tau, and the linear shear stress"


def compute(setting: Setting) -> Found:
    """Pressure gradients of steady and start-up flow."""
    test = verification("test_viscoelastic")
    rows = [*giesekus(test, setting), *steady_laws(test, setting)]
    return Found(rows if setting.quick else [*rows, *start_up(test)])


def giesekus(test: Any, setting: Setting) -> list[Comparison]:
    """The Giesekus liquid of the study: one-dimensional solver and mesh against an independent solution."""
    rows = []
    for De in (1.0,) if setting.quick else (0.5, 1.0):
        liquid = single(Giesekus(), De)
        flow = Pipe(liquid).steady()
        key, what = f"De {De:g}", f"Giesekus, De {De:g}, one dimension"
        for name, value in (
            ("dp/L", flow.gradient),
            ("u(0)", flow.u[0]),
            ("c_rz wall", flow.c[-1, 1]),
            ("c_zz wall", flow.c[-1, 0]),
            ("c_rr wall", flow.c[-1, 2]),
        ):
            rows.append(against(reference("tube", f"{name} {key}"), what, name, value, 1e-7, headline=name == "dp/L"))
        if not setting.quick:
            gradient, centre = test.pipe_in_two_dimensions(liquid, [20 * De], length=LENGTH, max_size=CELLS)[20 * De]
            what = f"Giesekus, De {De:g}, mesh"
            rows.append(against(reference("tube", f"dp/L {key}"), what, "dp/L", gradient, 1e-4, headline=True))
            rows.append(against(reference("tube", f"u(0) {key}"), what, "u(0)", centre, 1e-4))
    return rows


def steady_laws(test: Any, setting: Setting) -> list[Comparison]:
    """Every law at De 0.8: the one-dimensional solver, and the mesh after 20 De, against the law's own steady shear."""
    rows = []
    for name, liquid in test.LAWS.items():
        exact = gradient_of(test, liquid)
        what = f"{name}, De {liquid.De:g}"
        found = Pipe(liquid).steady().gradient
        rows.append(Comparison(f"{what}, one dimension", "dp/L", found, None, exact, OWN, 1e-6, table="laws"))
        if not setting.quick:
            end = 20 * liquid.De
            mesh = test.pipe_in_two_dimensions(liquid, [end], length=LENGTH, max_size=CELLS)[end][0]
            rows.append(Comparison(f"{what}, mesh", "dp/L", mesh, None, exact, OWN, 4e-4, name != "giesekus", "laws"))
    return rows


def gradient_of(test: Any, liquid: Liquid, points: int = 40) -> float:
    """Pressure gradient at unit mean velocity from steady shear alone (Rabinowitsch).

    The shear stress sigma grows linearly with r, so that a shear rate g is found at r = R sigma(g)/sigma(g_w), and the
    flow rate is pi (R^3 g_w - int_0^g_w r(g)^3 dg)/3.
    """
    x, w = np.polynomial.legendre.leggauss(points)

    def sigma(rate: float) -> float:
        return float(liquid.xi * rate + test.steady_shear(liquid, rate)[1])

    def excess(wall: float) -> float:
        at_wall = sigma(wall)
        r = np.array([TUBE_RADIUS * sigma(rate) / at_wall for rate in wall * (x + 1) / 2])
        return float(np.pi * (TUBE_RADIUS**3 * wall - wall / 2 * w @ r**3) / 3 - FLOW_RATE)

    return 2 * sigma(float(brentq(excess, 6.0, 60.0, xtol=1e-9))) / TUBE_RADIUS


def start_up(test: Any) -> list[Comparison]:
    """Start-up at constant flow rate, De 1, on the mesh."""
    times = [float(t) for t in test.START_UP]
    liquid = single(Giesekus(), 1.0)
    found = test.pipe_in_two_dimensions(liquid, times, length=LENGTH, max_size=CELLS)
    rows = []
    for t in times:
        known, what = reference("tube start-up", f"dp/L t {t:g}"), f"Giesekus, De 1, mesh, t = {t:g}"
        rows.append(against(known, what, "dp/L", found[t][0], 2e-3, table="start-up", headline=t == 0.5))
    oldroyd = single(OldroydB(), 1.0)
    found = test.pipe_in_two_dimensions(oldroyd, times, length=LENGTH, max_size=CELLS)
    exact = "exact: 32 [xi + (1 - xi)(1 - exp(-t/De))]"
    for t in times:
        gradient = 32 * (liquid.xi + (1 - liquid.xi) * (1 - np.exp(-t)))
        what, headline = f"Oldroyd-B, De 1, mesh, t = {t:g}", t == 0.5
        rows.append(Comparison(what, "dp/L", found[t][0], None, gradient, exact, 2e-3, headline, "start-up"))
    return rows

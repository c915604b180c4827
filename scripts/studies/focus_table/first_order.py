"""Rates of a bead alone to first order in softness, elasticity and inertia, and how far first order reaches.

Rates are those of `pairsim focus` at a Ca_e or De so small that the next term is below 1e-3 of them. How far first
order reaches is found by raising Ca_e or De until the rates are off by `OFF`, with laws that differ in what is beyond
it.
"""

from __future__ import annotations

from contextlib import closing
from math import inf
from typing import Any

import numpy as np

import pairsim
from pairsim.atlas.focusing import OFF, WALL_RATE
from pairsim.computing.problems import steady_problem
from pairsim.physics.slow_flow import departure
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.focus.inertia import by_inertia
from pairsim.solvers.focus.rates import Displacement, disturb
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.steady.scene import SteadySolver

SMALL, XI = 1e-3, 0.09
FINE, COARSE = {"Np": 20, "max_size": 0.06}, {"Np": 12, "max_size": 0.1}
"""Cells of the rates, and of the limits."""
LEAST, FIRST = 0.002, 0.03  # values of De or Ca_e with which limits are looked for
LEAST_STEP, MOST_STEP = 1.2, 2.0  # factors of the steps
MOST = {"De": 0.5, "Ca_e": 0.3}
OLDROYD_B: dict[str, Any] = {"law": "oldroyd-b"}
THINNING: list[dict[str, Any]] = [
    *({"law": "giesekus", "alpha": alpha} for alpha in (0.05, 0.2, 1.0)),
    {"law": "ptt-linear", "epsilon": 0.25},
    *({"law": "fene-p", "L2": L2} for L2 in (10.0, 50.0)),
]
SOLIDS: list[dict[str, Any]] = [{"law": "neo-hookean"}, {"law": "mooney-rivlin", "c": 1.0}]


def scene_of(**keys: Any) -> SteadySolver:
    """The solved scene of a bead alone."""
    case = pairsim.load({"particles": 1, "ends": "developed", "length": "auto", **keys}, kind="focus")
    start = Parameters((), case.solid_models, case.liquid_model)
    return arrived(first_scene(steady_problem(case, inf), start))


def rate_of(**keys: Any) -> float:
    """The rate of a bead alone [U_av/D_c].

    Raises:
        NoSteadyState: There is no steady state, or the liquid remembers longer than the displacement lasts.
    """
    with closing(scene_of(**keys)) as scene:
        found = disturb(scene)
    if not found.converged:
        raise NoSteadyState("the rates have not converged")
    return float(found.rates[0, 0])


def reach(key: str, **keys: Any) -> float:
    """The De or Ca_e up to which a rate is proportional to it within `OFF`; or the last one with a steady state.

    The next term of the rate is of third order in the velocity of the flow, as the rate does not change when the flow
    turns back: what it is off grows as the square.
    """
    first = rate_of(**keys, **{key: LEAST}) / LEAST
    points, value = [(LEAST, 0.0)], FIRST
    while points[-1][1] <= OFF and value < MOST[key]:
        try:
            points.append((value, abs(rate_of(**keys, **{key: value}) / value / first - 1)))
        except (NoSteadyState, MeshFailure):
            return points[-1][0]
        value *= min(max((OFF / max(points[-1][1], 1e-9)) ** 0.5, LEAST_STEP), MOST_STEP)
    (a, below), (b, above) = points[-2:]
    return b if above <= OFF else float(np.interp(OFF, [below, above], [a**2, b**2]) ** 0.5)


def rates_of(beta: float, mesh: dict[str, Any]) -> dict[str, float]:
    """The velocity of a bead of some diameter, and the derivatives of its rate."""
    soft = rate_of(beta=beta, Ca_e=SMALL, mesh=mesh) / SMALL
    elastic: dict[str, Any] = {"beta": beta, "Ca_e": 0, "De": SMALL, "xi": XI, "mesh": mesh}
    Psi_1 = 2 * (1 - XI) * SMALL
    first = rate_of(**elastic, liquid=OLDROYD_B)
    both = rate_of(**elastic, liquid={"law": "giesekus", "alpha": 1.0})  # where Psi_2 = -Psi_1/2
    with closing(scene_of(beta=beta, Ca_e=0, mesh=mesh)) as scene:
        with Displacement(scene) as displacement:
            inertia = float(by_inertia(displacement).rates[0, 0])
        U = float(scene.y[scene.constraints.fields["U_p"]][0])
    by_Psi = {"by_Psi_1": first / Psi_1, "by_Psi_2": (both - first) / (-Psi_1 / 2)}
    return {"U": U, "by_Ca_e": soft, **by_Psi, "by_Re": inertia}


def limits_of(beta: float) -> dict[str, float]:
    """How far first order reaches for a bead of some diameter."""
    Ca_e_most = min(reach("Ca_e", beta=beta, solid=solid, mesh=COARSE) for solid in SOLIDS)
    rigid: dict[str, Any] = {"beta": beta, "Ca_e": 0, "mesh": COARSE}
    De_most = min(reach("De", **rigid, liquid=OLDROYD_B, xi=xi) for xi in (XI, 0.5))
    departures = [thinning_at_reach(De_most, **rigid, liquid=liquid, xi=XI) for liquid in THINNING]
    return {"Ca_e_most": Ca_e_most, "De_most": De_most, "departure_most": min(departures)}


def thinning_at_reach(De_most: float, **keys: Any) -> float:
    """How much of the departure from slow shear at the wall there is where first order is off, beside what De does.

    It is that at which (De/De_most)^2 + departure/this = 1 there; infinite where De alone tells the end.
    """
    De = reach("De", **keys)
    case = pairsim.load({"particles": 1, "De": De, **keys}, kind="focus")
    left = 1 - (De / De_most) ** 2
    found = departure(case.liquid_model, WALL_RATE)
    return found / left if left > 0 else inf

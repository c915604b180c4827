"""The laws of the study, their flow on the mesh, and what follows from their steady shear alone."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.liquids import Liquid, single
from pairsim.physics.liquids.conformation import ConformationLaw
from pairsim.physics.liquids.fene_p import FeneP
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.liquids.ptt import ExponentialPTT, LinearPTT
from pairsim.physics.liquids.white_metzner import WhiteMetzner
from pairsim.quantities.scales import FLOW_RATE, TUBE_RADIUS
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.transient import Transient

DE = 0.8
LAWS = {
    law.name: single(law, De=DE)
    for law in (OldroydB(), Giesekus(), LinearPTT(epsilon=0.25), ExponentialPTT(epsilon=0.25), FeneP(L2=50.0))
}
"""Every law at one De, by its name."""


def pipe_in_two_dimensions(
    liquid: Liquid, times: list[float], length: float = 0.5, **mesh: float
) -> dict[float, tuple[float, float]]:
    """Pressure gradient and axial velocity on the mesh of a piece of tube without particles, repeated without end."""
    problem = Problem(
        betas=(),
        solids=(),
        gaps=(),
        length=length,
        periodic=True,
        mesh=MeshSettings(**mesh),  # type: ignore[arg-type]
        control=StepControl(3e-4, 1e-8, 1.0),
        first_step=1e-3,
        liquid=liquid,
        t_end=times[-1],
    )
    transient = Transient(problem)
    found = {}
    for step in transient.steps(iter(times)):
        for t in times:
            if abs(step.t - t) < 1e-9:
                axis = step.scene.liquid.index("u", step.scene.nodes.axis)
                found[t] = step.observation.dp / length, float(step.x[axis].mean())
    transient.close()
    return found


def steady_shear(law: ConformationLaw, g: float, De: float = DE) -> tuple[float, float, float]:
    """Shear stress, N1 and N2 over (1 - xi)/De at the Weissenberg number g, closed or from a scalar equation."""
    match law:
        case Giesekus(alpha=a):  # Bird, Armstrong and Hassager (1987), table 7.3-1
            chi = np.sqrt((np.sqrt(1 + 16 * a * (1 - a) * g**2) - 1) / (8 * a * (1 - a) * g**2))
            f = (1 - chi) / (1 + (1 - 2 * a) * chi)
            return g * (1 - f) ** 2 / (1 + (1 - 2 * a) * f), 2 * f * (1 - a * f) / (a * (1 - f)), -f
        case LinearPTT(epsilon=e):
            x = brentq(lambda x: x * (1 + 2 * e * x**2) - g, 0, g)
        case ExponentialPTT(epsilon=e):
            x = brentq(lambda x: np.log(x / g) + 2 * e * x**2, 1e-3 * g, g)
        case FeneP(L2=L2):
            x = g / brentq(lambda F: L2 * (F**3 - F**2) - 2 * g**2, 1, 10)
        case WhiteMetzner(n=n, Cu=Cu):
            x = g * (1 + (Cu * g / De) ** 2) ** ((n - 1) / 2)
        case _:
            x = g
    return float(x), float(2 * x**2), 0.0


def gradient_of(liquid: Liquid, points: int = 40) -> float:
    """Pressure gradient at unit mean velocity from steady shear alone (Rabinowitsch).

    The shear stress sigma grows linearly with r, so that a shear rate g is found at r = R sigma(g)/sigma(g_w), and the
    flow rate is pi (R^3 g_w - int_0^g_w r(g)^3 dg)/3.
    """
    x, w = np.polynomial.legendre.leggauss(points)

    def sigma(rate: float) -> float:
        polymer = (1 - liquid.xi) / liquid.De * steady_shear(liquid.modes[0], liquid.De * rate)[0]
        return float(liquid.xi * rate + polymer)

    def excess(wall: float) -> float:
        at_wall = sigma(wall)
        r = np.array([TUBE_RADIUS * sigma(rate) / at_wall for rate in wall * (x + 1) / 2])
        return float(np.pi * (TUBE_RADIUS**3 * wall - wall / 2 * w @ r**3) / 3 - FLOW_RATE)

    return 2 * sigma(float(brentq(excess, 6.0, 60.0, xtol=1e-9))) / TUBE_RADIUS

"""A soft sphere in unbounded uniaxial extension: exact at finite deformation, so that it tests the coupled dynamics.

Forms, constraints and time scheme are those of every run; only the velocity on the outer boundary, 20 radii away, is
prescribed instead of a tube flow. The sphere becomes a spheroid of axial stretch l. With the stresslet of a spheroid
whose surface moves linearly, l follows from dl/dt = l (K Ca_e - T)/(K - 3 + 3 eta_p), K = 7.5 X l^3, time in eta_0/G_p,
with the elastic stress T = sigma_zz - sigma_rr in units of G_p, l^2 - 1/l of a neo-Hookean solid, and its viscosity.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing

import numpy as np
from scipy.integrate import solve_ivp

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.drive import Drive
from pairsim.physics.solids import Solid
from pairsim.runtime.arrays import Array
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.transient import Transient

BETA = 0.05  # the wall of the tube is 20 radii away, so are the ends


def problem_in_extension(solid: Solid, rate: float = 1.0, l_0: float = 1.0, Np: int = 20) -> Problem:
    """The problem, from an axial stretch l_0."""
    return Problem(
        betas=(BETA,),
        solids=(solid,),
        gaps=(),
        length=1.0,
        periodic=False,
        mesh=MeshSettings(Np=Np),
        control=StepControl(3e-4 * BETA / 2, 1e-9, 5.0),  # velocities are of the order of radius times rate
        first_step=0.01 * solid.Ca_e,
        drive=Drive(boundary=lambda x: rate * x * [1.0, -0.5]),
        U_m=0.0,
        start=lambda x: x * [l_0, l_0**-0.5],
    )


def stretches(
    solid: Solid, times: Sequence[float], *, rate: float = 1.0, l_0: float = 1.0, Np: int = 20
) -> list[float]:
    """Axial stretch at the times t G_p/eta_0."""
    ends = [t * solid.Ca_e for t in times]
    landed = {round(t, 12) for t in ends}

    def stretch(step: Step) -> float:
        D = step.observation.D[0]
        return float(((1 + D) / (1 - D)) ** (2 / 3))

    with closing(Transient(problem_in_extension(solid, rate, l_0, Np))) as transient:
        return [stretch(step) for step in transient.steps(iter(ends)) if round(step.t, 12) in landed]


def K(stretch: float) -> float:
    """The stresslet of the flow around a spheroid, 7.5 X l^3."""
    e = np.sqrt(1 - stretch**-3)
    X = 8 / 15 * e**5 / ((3 - e**2) * np.log((1 + e) / (1 - e)) - 6 * e) if e > 1e-3 else 1.0
    return float(7.5 * X * stretch**3)


def exact_stretches(solid: Solid, times: Sequence[float]) -> Array:
    """The axial stretch from rest by its ordinary differential equation, at the times t G_p/eta_0."""

    def rate(_: float, x: Array) -> list[float]:
        zz, _, rr, _ = solid.stress((x[0] ** 2, 0.0, 1 / x[0], 1 / x[0]))
        return [x[0] * (K(x[0]) - zz + rr) * solid.Ca_e / (K(x[0]) - 3 + 3 * (solid.viscosity or 0.0))]

    return np.asarray(solve_ivp(rate, (0, max(times)), [1.0], t_eval=times, rtol=1e-9, atol=1e-10).y[0])


def steady_Ca(stretch: float) -> float:
    """The Ca at which a neo-Hookean sphere has a steady axial stretch."""
    return (stretch**2 - 1 / stretch) / K(stretch)

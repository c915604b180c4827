"""A soft sphere in unbounded uniaxial extension, whose finite deformation is known exactly."""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot
from scipy.optimize import brentq

from pairsim.drivers.sphere_in_extension import exact_stretches, stretches
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.solids import soft
from pairsim.physics.solids.neo_hookean import NeoHookean
from pairsim.runtime.errors import BranchEnd
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import begin, follow
from pairsim.solvers.steady.scene import Steady
from validation_book.comparisons import Comparison, Found, Setting, against, reference, verification

EXACT = "spheroid"


def compute(setting: Setting) -> Found:
    """Steady shapes, start-up, relaxation and the fold."""
    test = verification("test_extension")
    rows = steady(setting)
    times = list(test.START_UP)
    solid = NeoHookean(0.1)
    found = stretches(solid, times, Np=14 if setting.quick else 20)
    allowed = 5e-3 if setting.quick else 1e-3
    rows += compared("start-up, Ca 0.1", times, found, exact_stretches(solid, times).tolist(), allowed, "start-up")
    if setting.quick:
        return Found(rows)
    draw(setting, test, times, found)
    times, exact = list(test.RELAXATION), list(test.RELAXATION.values())
    back = stretches(solid, times, rate=0.0, l_0=1.3, Np=20)
    rows += compared("relaxation from l = 1.3", times, back, exact, 1e-3, "relaxation")
    rows.append(fold(test))
    return Found(rows)


def compared(
    what: str, times: list[float], found: list[float], exact: list[float], allowed: float, table: str
) -> list[Comparison]:
    """The stretch at some times."""
    return [
        Comparison(f"{what}, t G/eta = {t:g}", "l", float(a), None, float(b), EXACT, allowed, t == 2, table)
        for t, a, b in zip(times, found, exact, strict=True)
    ]


def steady(setting: Setting) -> list[Comparison]:
    """Taylor parameters of steady shapes, 20 radii from the wall."""
    Np = 14 if setting.quick else 28
    problem = SteadyProblem((0.02,), 1.0, False, MeshSettings(Np=Np), boundary_velocity=lambda x: x * [1.0, -0.5])
    sphere, rows = Steady(problem, Parameters((), soft(0.05))), []
    begin(sphere)
    for Ca in (0.05, 0.1, 0.2):
        follow(sphere, Parameters((), soft(Ca)))
        D = float(sphere.observe().D[0])
        rows.append(
            against(reference("extension", f"D Ca {Ca:g}"), f"steady, Ca {Ca:g}", "D", D, 2e-3, headline=Ca == 0.2)
        )
    sphere.close()
    return rows


def fold(test: object) -> Comparison:
    """The largest Ca with a steady shape, with a displacement inside the sphere that is a polynomial of degree 3."""
    problem = SteadyProblem((0.02,), 1.0, False, MeshSettings(Np=28), boundary_velocity=lambda x: x * [1.0, -0.5])
    sphere = test.SmoothSphere(problem, Parameters((), soft(0.05)), 3)  # type: ignore[attr-defined]
    begin(sphere)
    follow(sphere, Parameters((), soft(0.2)))
    Ca = np.nan
    try:
        follow(sphere, Parameters((), soft(1.0)))
    except BranchEnd as end:
        Ca, _ = end.at["Ca_e"]
    sphere.close()
    return against(reference("extension", "fold"), "fold of steady shapes", "Ca", Ca, 5e-3, headline=True, table="fold")


def draw(setting: Setting, test: object, times: list[float], found: list[float]) -> None:
    """The stretch against time below the fold, computed and exact."""
    t = np.linspace(0.01, max(times), 200)
    figure, axis = pyplot.subplots(figsize=(5, 3.4))
    axis.plot(t, exact_stretches(NeoHookean(0.1), list(t)), "k-", lw=1, label="exact")
    axis.plot(times, found, "o", ms=5, label="pairsim")
    end = brentq(lambda x: test.steady_Ca(x) - 0.1, 1.1, 2.0)  # type: ignore[attr-defined]
    axis.axhline(end, color="grey", lw=0.8, ls="--", label="steady")
    axis.set(xlabel=r"$t\,G/\eta$", ylabel="axial stretch $l$")
    axis.legend()
    figure.tight_layout()
    figure.savefig(setting.pictures / "extension.png", dpi=150)
    pyplot.close(figure)

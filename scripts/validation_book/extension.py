"""A soft sphere in unbounded uniaxial extension, whose finite deformation is known exactly."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib import pyplot
from scipy.optimize import brentq

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.drive import Drive
from pairsim.physics.solids import soft
from pairsim.physics.solids.neo_hookean import NeoHookean
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import begin, follow
from pairsim.solvers.steady.scene import SteadySolver
from validation_book.page import Page, verification
from validation_book.sphere_in_extension import exact_stretches, stretches

SOLID, L_0 = NeoHookean(0.1), 1.3


def problem(Np: int) -> SteadyProblem:
    """A sphere in extension, whose wall is 50 radii away."""
    drive = Drive(boundary=lambda x: x * [1.0, -0.5])
    return SteadyProblem(betas=(0.02,), length=1.0, periodic=False, mesh=MeshSettings(Np=Np), drive=drive)


def steady(page: Page) -> pd.DataFrame:
    """Taylor parameters of steady shapes."""
    sphere, D = SteadySolver(problem(14 if page.quick else 28), Parameters((), soft(0.05))), {}
    begin(sphere)
    for Ca in (0.05, 0.1, 0.2):
        follow(sphere, Parameters((), soft(Ca)))
        D[Ca] = sphere.observe().D[0]
    sphere.close()
    return pd.Series(D, name="D").rename_axis("Ca").reset_index()


def fold(page: Page) -> pd.DataFrame:
    """The largest Ca with a steady shape, with a displacement inside the sphere that is a polynomial of degree 3."""
    sphere = verification("test_extension").SmoothSphere(problem(28), Parameters((), soft(0.05)), 3)
    begin(sphere)
    follow(sphere, Parameters((), soft(0.2)))
    end = follow(sphere, Parameters((), soft(1.0)))
    Ca, _ = end.at["Ca_e"] if end is not None and end.proven else (np.nan, np.nan)
    sphere.close()
    return pd.DataFrame({"Ca of the fold": [Ca]})


def in_time(page: Page) -> pd.DataFrame:
    """The stretch from rest, which is drawn, and without flow from L_0."""
    test, Np = verification("test_extension"), 14 if page.quick else 20
    start, back = list(test.START_UP), list(test.RELAXATION)
    found = {"start-up": pd.Series(stretches(SOLID, start, Np=Np), start)}
    found["exact start-up"] = pd.Series(exact_stretches(SOLID, start), start)
    found["relaxation"] = pd.Series(stretches(SOLID, back, rate=0.0, l_0=L_0, Np=Np), back)
    table = pd.DataFrame(found | {"exact relaxation": pd.Series(test.RELAXATION)}).sort_index()
    t = np.linspace(0.01, max(start), 200)
    figure, axis = pyplot.subplots(figsize=(5, 3.4))
    axis.plot(t, exact_stretches(SOLID, list(t)), "k-", lw=1, label="exact")
    axis.plot(table["start-up"].dropna(), "o", ms=5, label="pairsim")
    end = brentq(lambda x: test.steady_Ca(x) - SOLID.Ca_e, 1.1, 2.0)
    axis.axhline(end, color="grey", lw=0.8, ls="--", label="steady")
    axis.set(xlabel=r"$t\,G/\eta$", ylabel="axial stretch $l$")
    axis.legend()
    page.save_picture(figure)
    return table.rename_axis("t").reset_index()

"""Steady shapes, the fold, and motion in time: the parts of the study."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import nan
from pathlib import Path

from book.apart import apart
from book.study import Part, Row

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.drive import Drive
from pairsim.physics.solids import soft
from pairsim.physics.solids.neo_hookean import NeoHookean
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import begin, follow
from pairsim.solvers.steady.scene import SteadySolver
from studies.extension.references import RELAXATION, STEADY
from studies.extension.smooth_sphere import SmoothSphere
from studies.extension.spheroid import stretches

CA, L_0 = 0.1, 1.3
"""Ca of the motion in time, and the stretch from which it relaxes without flow."""
START_UP = (0.5, 1.0, 2.0, 3.0, 5.0, 10.0)
"""Times from rest in eta/G."""


def problem(Np: int) -> SteadyProblem:
    """A sphere in extension, whose wall is 50 radii away."""
    drive = Drive(boundary=lambda x: x * [1.0, -0.5])
    return SteadyProblem(betas=(0.02,), length=1.0, periodic=False, mesh=MeshSettings(Np=Np), drive=drive)


def steady(Np: int) -> list[Row]:
    """Taylor parameters of steady shapes."""
    sphere, rows = SteadySolver(problem(Np), Parameters((), soft(min(STEADY)))), list[Row]()
    begin(sphere)
    for Ca in STEADY:
        follow(sphere, Parameters((), soft(Ca)))
        rows.append({"kind": "steady", "Ca": Ca, "D": float(sphere.observe().D[0])})
    sphere.close()
    return rows


def fold(Np: int) -> list[Row]:
    """The largest Ca with a steady shape, with a displacement inside the sphere that is a polynomial of degree 3."""
    sphere = SmoothSphere(problem(Np), Parameters((), soft(min(STEADY))), 3)
    begin(sphere)
    follow(sphere, Parameters((), soft(0.2)))
    end = follow(sphere, Parameters((), soft(1.0)))
    Ca, error = end.at["Ca_e"] if end is not None and end.proven else (nan, nan)
    sphere.close()
    return [{"kind": "fold", "Ca": Ca, "error": error}]


def start_up(Np: int) -> list[Row]:
    """The stretch from rest."""
    found = stretches(NeoHookean(CA), START_UP, Np=Np)
    return [{"kind": "start-up", "Ca": CA, "t": t, "stretch": x} for t, x in zip(START_UP, found, strict=True)]


def relaxation(Np: int) -> list[Row]:
    """The stretch without flow from `L_0`."""
    found = stretches(NeoHookean(CA), list(RELAXATION), rate=0.0, l_0=L_0, Np=Np)
    return [{"kind": "relaxation", "Ca": CA, "t": t, "stretch": x} for t, x in zip(RELAXATION, found, strict=True)]


def parts(quick: bool) -> list[Part]:
    """All of these; the quick form has coarse cells and leaves the fold out."""
    wanted: dict[Callable[[int], list[Row]], tuple[int, int]] = {
        steady: (28, 14),
        start_up: (20, 14),
        relaxation: (20, 14),
        fold: (28, 0),
    }
    cells = {function: each[quick] for function, each in wanted.items()}
    return [
        Part(function.__name__.replace("_", "-"), f"{function.__name__} with {Np} cells", partial(_rows, function, Np))
        for function, Np in cells.items()
        if Np
    ]


def _rows(function: Callable[[int], list[Row]], Np: int, folder: Path) -> Sequence[Row]:
    return apart(function, Np)

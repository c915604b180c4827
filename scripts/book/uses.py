"""Packages and modules that results depend on, as `Study.uses` names them."""

from __future__ import annotations

OF_CASES = ("pairsim.cases.accuracy", "pairsim.computing.problems", "pairsim.computing.accuracy")
"""The modules that derive meshes and tolerances from the keys of a case."""


def physics(*laws: str) -> tuple[str, ...]:
    """The physics, with the laws whose files have these names; with all laws if none is named."""
    return (f"pairsim.physics[{','.join(laws)}]" if laws else "pairsim.physics", "pairsim.fem[-azimuthal]")


def solvers(*names: str) -> tuple[str, ...]:
    """Packages and modules of the solvers."""
    return tuple(f"pairsim.solvers.{name}" for name in names)


def steady(*laws: str) -> tuple[str, ...]:
    """What quasi-steady solutions of cases and their half-widths depend on, with the laws whose files are named."""
    packages = solvers("curves", "errors", "nonlinear", "steady")
    modules = solvers("goals", "mesh_transfer", "meshed_scene", "parameters", "pressure_drop", "problems", "solution")
    asked = ("pairsim.computing.steady", "pairsim.questions.curve.parts")  # whose goals decide on cells
    return (*physics(*laws), *packages, *modules, *OF_CASES, *asked)


def off_axis(*laws: str) -> tuple[str, ...]:
    """What rates of particles off the axis and their half-widths depend on, with the laws whose files are named."""
    packages = solvers("errors", "focus", "nonlinear", "steady")
    modules = solvers("mesh_transfer", "meshed_scene", "parameters", "problems")
    asked = ("pairsim.computing.off_axis", "pairsim.questions.focus")
    return (*physics(*laws), "pairsim.fem.azimuthal", *packages, *modules, *asked)


def in_time(*laws: str) -> tuple[str, ...]:
    """What runs in time depend on, with the laws whose files are named."""
    packages = solvers("nonlinear", "stepping", "transient")
    return (*physics(*laws), *packages, *solvers("mesh_transfer", "meshed_scene", "parameters", "problems"))

"""Packages and modules that results depend on, as `Study.uses` names them."""

from __future__ import annotations

OF_CASES = ("pairsim.cases.accuracy", "pairsim.computing.problems", "pairsim.computing.accuracy")
"""What makes meshes and tolerances of the keys of a case."""


def physics(*laws: str) -> tuple[str, ...]:
    """The physics, with those laws alone whose files have these names; all without any."""
    return (f"pairsim.physics[{','.join(laws)}]" if laws else "pairsim.physics", "pairsim.fem[-azimuthal]")


def solvers(*names: str) -> tuple[str, ...]:
    """Packages and modules of the solvers."""
    return tuple(f"pairsim.solvers.{name}" for name in names)


def steady(*laws: str) -> tuple[str, ...]:
    """Quasi-steady solutions of cases with their half-widths, of the laws whose files have these names."""
    packages = solvers("curves", "errors", "nonlinear", "steady")
    modules = solvers("goals", "mesh_transfer", "meshed_scene", "parameters", "pressure_drop", "problems", "solution")
    asked = ("pairsim.computing.steady", "pairsim.questions.curve.parts")  # whose goals decide on cells
    return (*physics(*laws), *packages, *modules, *OF_CASES, *asked)


def off_axis(*laws: str) -> tuple[str, ...]:
    """Rates of particles off the axis with their half-widths, of the laws whose files have these names."""
    packages = solvers("errors", "focus", "nonlinear", "steady")
    modules = solvers("mesh_transfer", "meshed_scene", "parameters", "problems")
    asked = ("pairsim.computing.off_axis", "pairsim.questions.focus")
    return (*physics(*laws), "pairsim.fem.azimuthal", *packages, *modules, *asked)


def in_time(*laws: str) -> tuple[str, ...]:
    """Runs in time, of the laws whose files have these names."""
    packages = solvers("nonlinear", "stepping", "transient")
    return (*physics(*laws), *packages, *solvers("mesh_transfer", "meshed_scene", "parameters", "problems"))
